#include "tests/acceptance/hidden/score.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>

namespace sysid {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

bool Means(const Outcome::Candidate& candidate, const std::string& planted) {
  if (candidate.name == planted) return true;
  const auto& others = candidate.indistinguishable_from;
  return std::find(others.begin(), others.end(), planted) != others.end();
}

std::string Kind(const std::string& effect) {
  return effect.substr(0, effect.find('@'));
}

double Median(std::vector<double> values) {
  std::erase_if(values, [](double v) { return std::isnan(v); });
  if (values.empty()) return kNan;
  std::nth_element(values.begin(), values.begin() + values.size() / 2,
                   values.end());
  return values[values.size() / 2];
}

std::string Number(double value, const char* format = "%.2f") {
  if (std::isnan(value)) return "";
  char text[32];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

using Cases = std::vector<const Scored*>;
using Test = std::function<bool(const Scored&)>;

// "12 of 13", empty where there is none.
std::string Share(const Cases& cases, const Test& test) {
  if (cases.empty()) return "";
  const auto held = std::count_if(cases.begin(), cases.end(),
                                  [&](const Scored* s) { return test(*s); });
  return std::to_string(held) + " of " + std::to_string(cases.size());
}

std::string Percent(const Cases& cases, const Test& test) {
  if (cases.empty()) return "";
  const auto held = std::count_if(cases.begin(), cases.end(),
                                  [&](const Scored* s) { return test(*s); });
  return Number(100.0 * held / cases.size(), "%.1f %%");
}

Cases Those(const Cases& cases, const Test& test) {
  Cases out;
  for (const Scored* s : cases) {
    if (test(*s)) out.push_back(s);
  }
  return out;
}

double MedianOf(const Cases& cases,
                const std::function<double(const Scored&)>& value) {
  std::vector<double> values;
  for (const Scored* s : cases) values.push_back(value(*s));
  return Median(values);
}

void AddRow(const std::string& name, const Cases& cases, std::string* text) {
  const Cases shown =
      Those(cases, [](const Scored& s) { return !s.complete() && s.Shows(); });
  const Cases complete =
      Those(cases, [](const Scored& s) { return s.complete(); });
  const double before =
      MedianOf(shown, [](const Scored& s) { return s.outcome.train_before; });
  const double after =
      MedianOf(shown, [](const Scored& s) { return s.outcome.holdout_after; });
  *text +=
      "| " + name + " | " + std::to_string(cases.size()) + " | " +
      std::to_string(shown.size()) + " | " +
      Share(shown, [](const Scored& s) { return s.Hit(); }) + " | " +
      Share(shown, [](const Scored& s) { return s.FoundAll(); }) + " | " +
      Number(before, "%.1f") + " | " + Number(after) + " | " +
      Share(shown, [](const Scored& s) { return s.AtNoise(); }) + " | " +
      Number(MedianOf(
          shown, [](const Scored& s) { return s.PredictedOverAchieved(); })) +
      " | " + Share(complete, [](const Scored& s) { return s.FalseAlarm(); }) +
      " | " +
      Number(MedianOf(cases, [](const Scored& s) { return s.outcome.seconds; }),
             "%.1f") +
      " |\n";
}

// A table of rows by what `name` says of a case (it may say several).
void AddTable(
    const std::string& title, const Cases& cases,
    const std::function<std::vector<std::string>(const Scored&)>& name,
    std::string* text) {
  std::map<std::string, Cases> rows;
  for (const Scored* s : cases) {
    for (const std::string& row : name(*s)) rows[row].push_back(s);
  }
  *text +=
      "\n| " + title +
      " | cases | above 1.5 | first | all added | before | held out, after "
      "| at most 1.1 | predicted / achieved | false alarms | s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [row, scored] : rows) AddRow(row, scored, text);
}

}  // namespace

bool Scored::Shows() const {
  constexpr double kShows = 1.5;
  return outcome.train_before > kShows &&
         std::all_of(without.begin(), without.end(),
                     [](double error) { return error > kShows; });
}

bool Scored::Hit() const {
  return !outcome.ranked.empty() &&
         std::any_of(info.planted.begin(), info.planted.end(),
                     [&](const std::string& planted) {
                       return Means(outcome.ranked.front(), planted);
                     });
}

bool Scored::FoundAll() const {
  return std::all_of(info.planted.begin(), info.planted.end(),
                     [&](const std::string& planted) {
                       return std::any_of(outcome.added.begin(),
                                          outcome.added.end(),
                                          [&](const Outcome::Step& step) {
                                            return Means(step.added, planted);
                                          });
                     });
}

bool Scored::FalseAlarm() const {
  return complete() &&
         (!outcome.added.empty() || outcome.verdict != "adequate");
}

bool Scored::AtNoise() const { return outcome.train_after <= 1.1; }

double Scored::PredictedOverAchieved() const {
  if (outcome.added.empty()) return kNan;
  const Outcome::Step& step = outcome.added.front();
  return (step.train_before - step.predicted_after) /
         (step.train_before - step.train_after);
}

std::string SuiteTable(const std::vector<Scored>& cases) {
  Cases all;
  for (const Scored& s : cases) {
    if (s.outcome.fault.empty()) all.push_back(&s);
  }
  const Cases shown =
      Those(all, [](const Scored& s) { return !s.complete() && s.Shows(); });
  const Cases singles =
      Those(shown, [](const Scored& s) { return s.info.planted.size() == 1; });
  const Cases pairs =
      Those(shown, [](const Scored& s) { return s.info.planted.size() == 2; });
  const Cases complete =
      Those(all, [](const Scored& s) { return s.complete(); });
  std::string text = "| promise | measured |\n|---|---|\n";
  const auto promise = [&](const std::string& name, const Cases& of,
                           const Test& test) {
    text += "| " + name + " | " + Percent(of, test) + " (" + Share(of, test) +
            ") |\n";
  };
  promise("the hidden effect is first: 97 %", singles,
          [](const Scored& s) { return s.Hit(); });
  promise("one of a pair is first", pairs,
          [](const Scored& s) { return s.Hit(); });
  promise("both of a pair are added: 90 %", pairs,
          [](const Scored& s) { return s.FoundAll(); });
  promise("the error ends at most at 1.1: 95 %", shown,
          [](const Scored& s) { return s.AtNoise(); });
  promise("complete models without alarm: 98 %", complete,
          [](const Scored& s) { return !s.FalseAlarm(); });
  const long failed =
      std::count_if(cases.begin(), cases.end(),
                    [](const Scored& s) { return !s.outcome.fault.empty(); });
  if (failed > 0) {
    text += "| cases without a verdict | " + std::to_string(failed) + " |\n";
  }

  using Names = std::vector<std::string>;
  AddTable(
      "effect", all,
      [](const Scored& s) {
        if (s.complete()) return Names{"(none)"};
        if (s.info.planted.size() > 1) return Names{"(two)"};
        return Names{Kind(s.info.planted.front())};
      },
      &text);
  AddTable(
      "mechanism", all, [](const Scored& s) { return Names{s.info.mechanism}; },
      &text);
  AddTable(
      "engine, noise", all,
      [](const Scored& s) {
        return Names{s.info.engine, Number(s.info.noise, "%.0e")};
      },
      &text);
  return text;
}

std::string SuiteCsv(const std::vector<Scored>& cases) {
  std::string text =
      "case,magnitudes,verdict,shows,hit,found_all,first,added,train_before,"
      "train_after,holdout_before,holdout_after,predicted_after,seconds,"
      "fault\n";
  // Names of pairs and of typed laws have commas.
  const auto quoted = [](std::string text) {
    std::replace(text.begin(), text.end(), '"', '\'');
    std::replace(text.begin(), text.end(), '\n', ' ');
    return '"' + text + '"';
  };
  for (const Scored& s : cases) {
    std::string magnitudes, added;
    for (const double m : s.magnitudes) magnitudes += Number(m, "%.4g ");
    for (const Outcome::Step& step : s.outcome.added) {
      added += (added.empty() ? "" : " ") + step.added.name;
    }
    const double predicted = s.outcome.added.empty()
                                 ? kNan
                                 : s.outcome.added.front().predicted_after;
    const std::string first =
        s.outcome.ranked.empty() ? "" : s.outcome.ranked.front().name;
    text += quoted(s.info.name) + "," + magnitudes + "," + s.outcome.verdict +
            "," + std::to_string(s.Shows()) + "," + std::to_string(s.Hit()) +
            "," + std::to_string(s.FoundAll()) + "," + quoted(first) + "," +
            quoted(added);
    for (const double value :
         {s.outcome.train_before, s.outcome.train_after,
          s.outcome.holdout_before, s.outcome.holdout_after, predicted,
          s.outcome.seconds}) {
      text += "," + Number(value, "%.4g");
    }
    text += "," + quoted(s.outcome.fault) + "\n";
  }
  return text;
}

}  // namespace sysid
