// What a request says, as values of C++: options are the flags of
// docs/interface.md section 1, as text or as Python has them.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "models/error.h"
#include "python/native/functions.h"
#include "sysid/io/cell.h"
#include "sysid/session/named_values.h"
#include "sysid/session/run_list.h"
#include "sysid/session/session_options.h"

namespace sysid::python {
namespace {

[[noreturn]] void FailType(const std::string& place, const Json& value,
                           const std::string& takes) {
  throw InputError(place, "cannot be " + Compact(value), "it takes " + takes);
}

// A text as a flag has it, a list of such texts, or a dict of names and values
// (of what `member` makes of each).
template <typename Split, typename Member>
auto Entries(const Json& value, const std::string& place, const Split& split,
             const Member& member) -> decltype(split("")) {
  constexpr char kTakes[] = "a text, a list of texts, or a dict";
  decltype(split("")) entries;
  if (value.is_string()) return split(value.get<std::string>());
  if (value.is_object()) {
    for (const auto& [name, of] : value.items()) {
      entries.push_back(member(name, of));
    }
    return entries;
  }
  if (!value.is_array()) FailType(place, value, kTakes);
  for (const Json& each : value) {
    if (!each.is_string()) FailType(place, value, kTakes);
    for (auto& entry : split(each.get<std::string>())) {
      entries.push_back(std::move(entry));
    }
  }
  return entries;
}

template <typename Split>
std::vector<NamedValue> NamedValues(const Json& value, const std::string& place,
                                    const Split& split) {
  return EachOnce(
      Entries(
          value, place,
          [&](const std::string& text) { return split(text, place); },
          [&](const std::string& name, const Json& number) {
            NamedValue named{name, {}, place};
            if (!number.is_null()) named.value = Number(number, place);
            return named;
          }),
      place);
}

template <typename Split>
std::vector<std::string> Names(const Json& value, const std::string& place,
                               const Split& split) {
  return Entries(
      value, place, [&](const std::string& text) { return split(text, place); },
      [&](const std::string&, const Json&) -> std::string {
        FailType(place, value, "a text or a list of texts");
      });
}

ColumnMap Columns(const Json& value, const std::string& place) {
  return Entries(
      value, place,
      [&](const std::string& text) { return ParseColumnMap(text, place); },
      [&](const std::string& name, const Json& expression) {
        return ColumnMapping{name, Text(expression, place), place};
      });
}

std::vector<ChannelShift> Shifts(const Json& value, const std::string& place) {
  return Entries(
      value, place,
      [&](const std::string& text) { return ParseShifts(text, place); },
      [&](const std::string& name, const Json& delay) {
        return ChannelShift{name, Number(delay, place), place};
      });
}

std::vector<IgnoredSpan> Ignored(const Json& value, const std::string& place) {
  return Entries(
      value, place,
      [&](const std::string& text) { return ParseIgnored(text, place); },
      [&](const std::string& name, const Json& span) {
        if (!span.is_array() || span.size() != 2) {
          FailType(place, span, "the two ends of a span, s");
        }
        return IgnoredSpan{name, Number(span[0], place), Number(span[1], place),
                           place};
      });
}

using Setter = void (*)(const Json& value, const std::string& place,
                        FitRequest* request);
struct Option {
  const char* name;
  Setter set;
};

constexpr Option kOptions[] = {
    {"spec", [](const Json& v, const std::string& place,
                FitRequest* r) { r->spec = Text(v, place); }},
    {"free",
     [](const Json& v, const std::string& place, FitRequest* r) {
       r->free_none = v == "none";
       if (!r->free_none) r->free = Assignments(v, place);
     }},
    {"fix", [](const Json& v, const std::string& place,
               FitRequest* r) { r->fix = Assignments(v, place); }},
    {"add", [](const Json& v, const std::string& place,
               FitRequest* r) { r->add = Names(v, place, SplitEffectNames); }},
    {"candidates",
     [](const Json& v, const std::string& place, FitRequest* r) {
       r->candidates = Names(v, place, SplitEffects);
     }},
    {"lock", [](const Json& v, const std::string& place,
                FitRequest* r) { r->lock = Assignments(v, place); }},
    {"columns", [](const Json& v, const std::string& place,
                   FitRequest* r) { r->columns = Columns(v, place); }},
    {"shift", [](const Json& v, const std::string& place,
                 FitRequest* r) { r->shift = Shifts(v, place); }},
    {"ignore", [](const Json& v, const std::string& place,
                  FitRequest* r) { r->ignore = Ignored(v, place); }},
    {"solver",
     [](const Json& v, const std::string& place, FitRequest* r) {
       r->solver = Text(v, place);
       CheckWord("solver", r->solver);
     }},
    {"integrator",
     [](const Json& v, const std::string& place, FitRequest* r) {
       r->integrator = ParseIntegrator(Text(v, place), place);
     }},
    {"residual",
     [](const Json& v, const std::string& place, FitRequest* r) {
       r->residual = ParseOrientation(Text(v, place));
     }},
    {"loss", [](const Json& v, const std::string& place,
                FitRequest* r) { r->loss = ParseLoss(Text(v, place)); }},
    {"start", [](const Json& v, const std::string& place,
                 FitRequest* r) { r->start = ParseStart(Text(v, place)); }},
    {"check",
     [](const Json& v, const std::string& place, FitRequest* r) {
       r->check = ParseCheckLevel(Text(v, place));
     }},
    {"step", [](const Json& v, const std::string& place,
                FitRequest* r) { r->step = Number(v, place); }},
    {"segment", [](const Json& v, const std::string& place,
                   FitRequest* r) { r->segment = Number(v, place); }},
    {"noise", [](const Json& v, const std::string& place,
                 FitRequest* r) { r->noise = Number(v, place); }},
    {"time", [](const Json& v, const std::string& place,
                FitRequest* r) { r->time = Number(v, place); }},
    {"threads",
     [](const Json& v, const std::string& place, FitRequest* r) {
       r->threads = static_cast<int>(std::min<std::uint64_t>(
           Whole(v, place), std::numeric_limits<int>::max()));
     }},
    {"skip_bad_runs",
     [](const Json& v, const std::string& place, FitRequest* r) {
       r->skip_bad_runs = Truth(v, place);
     }},
};

// The recordings that a list names: files, and those in memory.
void TakeRuns(const Call& call, const Json& list, const std::string& flag,
              const Mechanism& mechanism, std::vector<std::string>* files,
              std::vector<Run>* runs, std::vector<std::string>* notices) {
  std::vector<std::string> entries;
  for (const Json& entry : list) {
    if (entry.contains("file")) {
      entries.push_back(entry["file"]);
    } else {
      if (entry.contains("table")) {
        CheckNames(call.tables.at(entry["table"]), mechanism);
      }
      runs->push_back(RunIn(call, entry, mechanism, {}, notices));
    }
  }
  *files = ExpandRuns(entries, flag);
}

}  // namespace

double Number(const Json& value, const std::string& place) {
  double number = 0.0;
  if (value.is_string() && ParseNumber(value.get<std::string>(), &number)) {
    return number;
  }
  if (!value.is_number()) FailType(place, value, "a number");
  return value.get<double>();
}

std::uint64_t Whole(const Json& value, const std::string& place) {
  const double number = Number(value, place);
  if (!(number >= 0 && number == std::floor(number) && number < 1e15)) {
    FailType(place, value, "a whole number from 0");
  }
  return static_cast<std::uint64_t>(number);
}

std::string Text(const Json& value, const std::string& place) {
  if (!value.is_string()) FailType(place, value, "a text");
  return value.get<std::string>();
}

bool Truth(const Json& value, const std::string& place) {
  if (!value.is_boolean()) FailType(place, value, "True or False");
  return value.get<bool>();
}

std::vector<NamedValue> Assignments(const Json& value,
                                    const std::string& place) {
  return NamedValues(value, place, SplitAssignments);
}

std::vector<NamedValue> EffectValues(const Json& value,
                                     const std::string& place) {
  return NamedValues(value, place, SplitEffectValues);
}

PythonCall CallIn(const Json& request) {
  const Json& call = request.at("call");
  return {call.at("arguments"), call.at("add"), call.at("fix")};
}

std::string Quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "'";
}

std::string Command(const std::string& function, const PythonCall& call,
                    const std::string& add, const std::string& fix) {
  std::string text = function + "(" + call.arguments;
  const auto keyword = [&](const char* name, const std::string& given,
                           const std::string& more) {
    const std::string value =
        given + (given.empty() || more.empty() ? "" : ",") + more;
    if (!value.empty()) text += std::string(", ") + name + "=" + Quoted(value);
  };
  keyword("add", call.add, add);
  keyword("fix", call.fix, fix);
  return text + ")";
}

void FillRequest(const Call& call, const std::vector<std::string>& own,
                 FitRequest* request, std::vector<std::string>* notices) {
  for (const auto& [name, value] : call.request.at("options").items()) {
    bool is_known = false;
    std::vector<std::string> known = own;
    for (const Option& option : kOptions) {
      known.push_back(option.name);
      if (name != option.name) continue;
      option.set(value, "--" + name, request);
      is_known = true;
    }
    for (const std::string& option : own) is_known |= option == name;
    if (!is_known) {
      throw InputError(name, "is no option", NameHint(name, known));
    }
  }
  const ModelHandle& model = ModelIn(call, call.request.at("model"));
  request->model = model.name;
  request->model_in_memory = model.model;
  TakeRuns(call, call.request.at("runs"), "--traj", model.mechanism,
           &request->traj, &request->runs, notices);
  TakeRuns(call, call.request.at("holdout"), "--holdout", model.mechanism,
           &request->holdout, &request->holdout_runs, notices);
}

}  // namespace sysid::python
