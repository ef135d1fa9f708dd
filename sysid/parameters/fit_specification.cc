#include "sysid/parameters/fit_specification.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "models/error.h"
#include "models/integrator.h"
#include "sysid/io/byte_source.h"
#include "sysid/io/csv.h"

namespace sysid {
namespace {

// A node of a file that errors name.
struct Node : YAML::Node {
  Node(const YAML::Node& node, const std::string& in)
      : YAML::Node(node), file(in) {}
  std::string file;
};

using Entry = std::pair<Node, Node>;

std::string Place(const std::string& file, const YAML::Mark& mark) {
  if (mark.is_null()) return file;
  return file + ":" + std::to_string(mark.line + 1) + ":" +
         std::to_string(mark.column + 1);
}

std::string Place(const Node& node) { return Place(node.file, node.Mark()); }

[[noreturn]] void Fail(const Node& node, const std::string& what,
                       const std::string& hint = "") {
  throw InputError(Place(node), what, hint);
}

// Notes where documents begin.
class DocumentMarks : public YAML::EventHandler {
 public:
  std::vector<YAML::Mark> marks;

  void OnDocumentStart(const YAML::Mark& mark) override {
    marks.push_back(mark);
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

constexpr char kYamlHint[] =
    "spaces, not tabs, make the indentation; brackets and quotes must be "
    "closed";

// The mark, or where the text ends if it is beyond that: yaml-cpp counts lines
// that are not there.
YAML::Mark Within(YAML::Mark mark, const std::string& text) {
  const size_t end = text.find_last_not_of("\r\n") + 1;
  const int last =
      static_cast<int>(std::count(text.begin(), text.begin() + end, '\n'));
  if (end == 0 || mark.line <= last) return mark;
  mark.line = last;
  mark.column = static_cast<int>(end - (text.rfind('\n', end - 1) + 1));
  return mark;
}

// YAML::Load takes the first document and is silent about the rest; what cannot
// stand in a document (a comma at its start) is an endless row of empty ones to
// YAML::LoadAll.
void CheckOneDocument(const std::string& file, const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentMarks documents;
  while (documents.marks.size() < 2 && parser.HandleNextDocument(documents)) {
  }
  if (documents.marks.size() < 2) return;
  const YAML::Mark& mark = documents.marks[1];
  const size_t begin = std::min<size_t>(mark.pos, text.size());
  const std::string rest =
      text.substr(begin, text.find_first_of("\r\n", begin) - begin);
  if (rest.starts_with("---")) {
    throw InputError(Place(file, mark), "a second document begins here",
                     "a specification is one document: remove the '---'");
  }
  throw InputError(Place(file, mark),
                   "is not YAML: " + Shown(rest) + " cannot stand here",
                   kYamlHint);
}

// The root of the text's only document; null where there is none.
Node Load(const std::string& file, const std::string& text) {
  // The comment makes yaml-cpp notice a quote that is open at the end.
  const std::string closed = text + "\n#";
  try {
    CheckOneDocument(file, closed);
    return {YAML::Load(closed), file};
  } catch (const YAML::Exception& error) {
    throw InputError(Place(file, Within(error.mark, text)),
                     "is not YAML: " + error.msg, kYamlHint);
  }
}

std::string KindOf(const Node& node) {
  if (node.IsMap()) return "a map";
  if (node.IsSequence()) return "a list";
  if (node.IsScalar()) return Shown(node.Scalar());
  return "nothing";
}

// The functions below take a node for what it should be, or throw; `what` names
// it in the text ("prior of x").

// The pairs of a map, in order. Throws for anything but a map, and for keys
// that are no names or appear twice.
std::vector<Entry> Map(const Node& node, const std::string& what,
                       const std::string& hint) {
  if (!node.IsMap()) {
    Fail(node, what + " must be a map, not " + KindOf(node), hint);
  }
  std::vector<Entry> entries;
  std::set<std::string> seen;
  for (const auto& pair : node) {
    const Node key(pair.first, node.file);
    if (!key.IsScalar()) {
      Fail(key, "a key of " + what + " must be a name, not " + KindOf(key));
    }
    if (key.Scalar().empty()) {
      Fail(key, "a key of " + what + " is empty", "write a name");
    }
    if (!seen.insert(key.Scalar()).second) {
      Fail(key, Shown(key.Scalar()) + " is given twice in " + what,
           "keep one of them");
    }
    entries.emplace_back(key, Node(pair.second, node.file));
  }
  return entries;
}

// Throws for a key without a value (YAML would place the fault at whatever
// follows).
void CheckValue(const Entry& entry) {
  if (!entry.second.IsNull()) return;
  Fail(entry.first, Shown(entry.first.Scalar()) + " has no value");
}

// Throws for a key that is not known, with the nearest.
void CheckKey(const Node& key, const std::string& of,
              const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), key.Scalar()) != known.end()) {
    return;
  }
  Fail(key, "unknown key " + Shown(key.Scalar()) + " in " + of,
       NameHint(key.Scalar(), known));
}

std::string Text(const Node& node, const std::string& what,
                 const std::string& hint = "") {
  if (!node.IsScalar() || node.Scalar().empty()) {
    Fail(node,
         what + " must be text, not " +
             (node.IsScalar() ? "nothing" : KindOf(node)),
         hint);
  }
  return node.Scalar();
}

double Number(const Node& node, const std::string& what) {
  double value;
  if (!node.IsScalar() || !ParseNumber(node.Scalar(), &value)) {
    Fail(node, what + " must be a number, not " + KindOf(node));
  }
  if (!std::isfinite(value)) {
    Fail(node, what + " must be finite, not " + KindOf(node));
  }
  return value;
}

Located<double> Positive(const Node& node, const std::string& what) {
  const double value = Number(node, what);
  if (value <= 0.0) Fail(node, what + " must be positive, not " + KindOf(node));
  return {value, Place(node)};
}

// One of the words of a key.
Located<std::string> Word(const Node& node, const std::string& key) {
  const std::vector<std::string>& known = KnownWords(key);
  const std::string word = Text(node, key, "known: " + Join(known));
  if (std::find(known.begin(), known.end(), word) == known.end()) {
    Fail(node, "there is no " + key + " " + Shown(word), NameHint(word, known));
  }
  return {word, Place(node)};
}

// The texts of a list, each once.
std::vector<Located<std::string>> NameList(const Node& node,
                                           const std::string& what,
                                           const std::string& hint) {
  if (!node.IsSequence()) {
    Fail(node, what + " must be a list, not " + KindOf(node), hint);
  }
  std::vector<Located<std::string>> names;
  std::set<std::string> seen;
  for (const YAML::Node& element : node) {
    const Node item(element, node.file);
    // A law without quotes, custom@joint1: -k*q, reads as a map of one entry.
    const bool is_law = item.IsMap() && item.size() == 1 &&
                        item.begin()->first.IsScalar() &&
                        item.begin()->first.Scalar().starts_with("custom@");
    const std::string name =
        is_law ? item.begin()->first.Scalar() + ": " +
                     Text(Node(item.begin()->second, node.file),
                          "an entry of " + what, hint)
               : Text(item, "an entry of " + what, hint);
    if (!seen.insert(name).second) {
      Fail(item, Shown(name) + " is given twice in " + what,
           "keep one of them");
    }
    names.push_back({name, Place(item)});
  }
  return names;
}

FreeParameter::Prior ReadPrior(const Node& node, const std::string& of) {
  const std::string what = "the prior of " + of;
  const std::string hint = "write prior: {mean: 0.4, std: 0.1}";
  std::optional<double> mean, std;
  for (const Entry& entry : Map(node, what, hint)) {
    const auto& [key, value] = entry;
    CheckKey(key, what, {"mean", "std"});
    CheckValue(entry);
    if (key.Scalar() == "mean") {
      mean = Number(value, "mean of " + what);
    } else {
      std = Positive(value, "std of " + what).value;
    }
  }
  if (!mean || !std) {
    Fail(node, what + " has no " + (mean ? "std" : "mean"), hint);
  }
  return {*mean, *std};
}

void CheckBounds(const Node& node, const FitSpecification::Free& free) {
  if (free.lower && free.upper && *free.lower >= *free.upper) {
    Fail(node,
         "the bounds of " + free.name + " are empty: lower " +
             ShortestText(*free.lower) + " is not below upper " +
             ShortestText(*free.upper),
         "to hold a parameter at a value, put it under fix");
  }
  if (!free.initial) return;
  const bool below = free.lower && *free.initial < *free.lower;
  const bool above = free.upper && *free.initial > *free.upper;
  if (!below && !above) return;
  Fail(node,
       "the bounds of " + free.name + " exclude its start: initial " +
           ShortestText(*free.initial) + " is " +
           (below ? "below lower " + ShortestText(*free.lower)
                  : "above upper " + ShortestText(*free.upper)),
       "widen the bounds, or start within them");
}

FitSpecification::Free ReadFreeEntry(const Entry& entry) {
  const auto& [key, settings] = entry;
  FitSpecification::Free free;
  free.name = key.Scalar();
  free.place = Place(key);
  if (settings.IsNull()) return free;
  for (const Entry& setting :
       Map(settings, free.name,
           "write " + free.name + ": {initial: 0.5, lower: 0.05, upper: 2}")) {
    const auto& [name, value] = setting;
    CheckKey(name, free.name, {"initial", "lower", "upper", "prior"});
    CheckValue(setting);
    if (name.Scalar() == "prior") {
      free.prior = ReadPrior(value, free.name);
      continue;
    }
    std::optional<double>& number = name.Scalar() == "initial" ? free.initial
                                    : name.Scalar() == "lower" ? free.lower
                                                               : free.upper;
    number = Number(value, name.Scalar() + " of " + free.name);
  }
  CheckBounds(settings, free);
  return free;
}

void ReadFree(const Node& node, FitSpecification* spec) {
  const std::string hint =
      "write free: {link1.length: {initial: 0.5}}, or a list of names";
  if (node.IsSequence()) {
    for (const auto& name : NameList(node, "free", hint)) {
      FitSpecification::Free& free = spec->free.emplace_back();
      free.name = name.value;
      free.place = name.place;
    }
    return;
  }
  for (const Entry& entry : Map(node, "free", hint)) {
    spec->free.push_back(ReadFreeEntry(entry));
  }
}

// A map of names to numbers or nothing, or a list of names.
std::vector<NamedValue> ReadValues(const Node& node, const std::string& what,
                                   const std::string& example) {
  const std::string hint =
      "write " + what + ": {" + example + "}, or a list of names";
  std::vector<NamedValue> values;
  if (node.IsSequence()) {
    for (const auto& name : NameList(node, what, hint)) {
      values.push_back({name.value, std::nullopt, name.place});
    }
    return values;
  }
  for (const auto& [key, value] : Map(node, what, hint)) {
    NamedValue named{key.Scalar(), std::nullopt, Place(key)};
    if (!value.IsNull()) named.value = Number(value, named.name);
    values.push_back(std::move(named));
  }
  return values;
}

void CheckFreeOrFixed(const FitSpecification& spec) {
  for (const NamedValue& fix : spec.fix) {
    for (const FitSpecification::Free& free : spec.free) {
      if (fix.name != free.name) continue;
      throw InputError(fix.place, Shown(fix.name) + " is both free and fixed",
                       "keep one of them");
    }
  }
}

void ReadColumns(const Node& node, FitSpecification* spec) {
  const std::string hint = "write columns: {t: time, joint1.q: pos1}";
  for (const Entry& entry : Map(node, "columns", hint)) {
    CheckValue(entry);
    const auto& [key, value] = entry;
    spec->columns.push_back({key.Scalar(),
                             Text(value, "the column of " + key.Scalar(), hint),
                             Place(key)});
  }
}

void ReadLoss(const Node& node, FitSpecification* spec) {
  if (!node.IsMap()) {
    spec->loss = Word(node, "loss");
    return;
  }
  for (const Entry& entry : Map(node, "loss", "")) {
    const auto& [key, value] = entry;
    CheckKey(key, "loss", {"name", "scale"});
    CheckValue(entry);
    if (key.Scalar() == "name") {
      spec->loss = Word(value, "loss");
    } else {
      spec->loss_scale = Positive(value, "scale of loss").value;
    }
  }
  if (!spec->loss) {
    Fail(node, "loss has no name", "write loss: {name: huber, scale: 1.5}");
  }
}

// A word without a slash and without ".urdf" is a shipped model's name.
std::string ResolveModel(const std::string& model, const std::string& file) {
  const bool is_file =
      model.find('/') != std::string::npos || model.ends_with(".urdf");
  if (!is_file) return model;
  const auto folder = std::filesystem::path(file).parent_path();
  return (folder / model).lexically_normal().string();
}

const std::vector<std::string>& TopKeys() {
  static const auto& keys = *new std::vector<std::string>{
      "model",      "free",     "fix",  "effects", "columns", "noise",
      "integrator", "residual", "step", "segment", "solver",  "loss",
      "shift",      "ignore",   "lock", "start"};
  return keys;
}

void ReadTop(const Entry& entry, FitSpecification* spec) {
  const auto& [key, value] = entry;
  CheckKey(key, "the specification", TopKeys());
  const std::string& name = key.Scalar();
  const bool may_be_empty = name == "free" || name == "fix" ||
                            name == "effects" || name == "columns" ||
                            name == "lock";
  if (may_be_empty && value.IsNull()) return;
  CheckValue(entry);
  if (name == "model") {
    spec->model = {ResolveModel(Text(value, "model"), value.file),
                   Place(value)};
  } else if (name == "free") {
    ReadFree(value, spec);
  } else if (name == "fix") {
    spec->fix = ReadValues(value, name, "link1.mass: 1.0");
  } else if (name == "lock") {
    spec->lock = ReadValues(value, name, "head_1: 0.3");
  } else if (name == "effects") {
    spec->effects =
        NameList(value, "effects", "write effects: [coulomb_friction@joint1]");
  } else if (name == "columns") {
    ReadColumns(value, spec);
  } else if (name == "shift") {
    spec->edits.shifts = ParseShifts(Text(value, name), Place(value));
  } else if (name == "ignore") {
    spec->edits.ignored = ParseIgnored(Text(value, name), Place(value));
  } else if (name == "loss") {
    ReadLoss(value, spec);
  } else if (name == "noise" || name == "step" || name == "segment") {
    (name == "noise"  ? spec->noise
     : name == "step" ? spec->step
                      : spec->segment) = Positive(value, name);
  } else {
    (name == "integrator" ? spec->integrator
     : name == "residual" ? spec->residual
     : name == "start"    ? spec->start
                          : spec->solver) = Word(value, name);
  }
}

}  // namespace

const std::vector<std::string>& KnownWords(const std::string& key) {
  static const auto& words =
      *new std::map<std::string, std::vector<std::string>>{
          {"integrator", IntegratorNames()},
          {"residual", {"heading", "rotation"}},
          {"solver", {"lm", "inverse_dynamics", "adam", "gmm"}},
          {"loss", {"none", "huber", "cauchy"}},
          {"start", {"estimated", "rest", "known"}}};
  return words.at(key);
}

FitSpecification ParseFitSpecification(const std::string& path,
                                       const std::string& text) {
  FitSpecification spec;
  spec.path = path;
  const Node root = Load(path, text);
  if (root.IsNull()) return spec;
  for (const Entry& entry :
       Map(root, "the specification",
           "write key: value; known keys: " + Join(TopKeys()))) {
    ReadTop(entry, &spec);
  }
  CheckFreeOrFixed(spec);
  return spec;
}

FitSpecification ReadFitSpecification(const std::string& path) {
  return ParseFitSpecification(path, ReadTextFile(path));
}

}  // namespace sysid
