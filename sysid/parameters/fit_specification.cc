#include "sysid/parameters/fit_specification.h"

#include <filesystem>

#include "models/error.h"
#include "sysid/io/csv.h"
#include "sysid/io/read_file.h"
#include "sysid/parameters/yaml_reader.h"

namespace sysid {
namespace {

class Reader : private YamlReader {
 public:
  using YamlReader::YamlReader;

  FitSpecification Read(const std::string& text);

 private:
  void ReadTop(const Entry& entry, FitSpecification* spec) const;
  void ReadFree(const YAML::Node& node, FitSpecification* spec) const;
  FitSpecification::Free ReadFreeEntry(const Entry& entry) const;
  void ReadPrior(const YAML::Node& node, FitSpecification::Free* free) const;
  void CheckBounds(const YAML::Node& node,
                   const FitSpecification::Free& free) const;
  void ReadFix(const YAML::Node& node, FitSpecification* spec) const;
  void ReadColumns(const YAML::Node& node, FitSpecification* spec) const;
  Located<FitSpecification::Loss> ReadLoss(const YAML::Node& node) const;
  std::string ResolveModel(const std::string& model) const;
};

const std::vector<std::string>& TopKeys() {
  static const auto& keys = *new std::vector<std::string>{
      "model",  "free",       "fix",      "effects", "columns",
      "noise",  "integrator", "residual", "step",    "segment",
      "solver", "loss",       "shift",    "ignore"};
  return keys;
}

void Reader::ReadPrior(const YAML::Node& node,
                       FitSpecification::Free* free) const {
  const std::string what = "the prior of " + free->name;
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
  free->prior = GaussianPrior{*mean, *std};
}

void Reader::CheckBounds(const YAML::Node& node,
                         const FitSpecification::Free& free) const {
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

FitSpecification::Free Reader::ReadFreeEntry(const Entry& entry) const {
  const auto& [key, settings] = entry;
  FitSpecification::Free free;
  free.name = key.Scalar();
  free.place = Place(key);
  if (settings.IsNull()) return free;
  const std::string& what = free.name;
  for (const Entry& setting :
       Map(settings, what,
           "write " + free.name + ": {initial: 0.5, lower: 0.05, upper: 2}")) {
    const auto& [name, value] = setting;
    CheckKey(name, what, {"initial", "lower", "upper", "prior"});
    CheckValue(setting);
    const std::string key_of = name.Scalar() + " of " + what;
    if (name.Scalar() == "prior") {
      ReadPrior(value, &free);
    } else if (name.Scalar() == "initial") {
      free.initial = Number(value, key_of);
    } else if (name.Scalar() == "lower") {
      free.lower = Number(value, key_of);
    } else {
      free.upper = Number(value, key_of);
    }
  }
  CheckBounds(settings, free);
  return free;
}

void Reader::ReadFree(const YAML::Node& node, FitSpecification* spec) const {
  const std::string hint =
      "write free: {link1.length: {initial: 0.5}}, or a list of names";
  if (node.IsSequence()) {
    for (const auto& name : NameList(node, "free", hint)) {
      FitSpecification::Free free;
      free.name = name.value;
      free.place = name.place;
      spec->free.push_back(free);
    }
    return;
  }
  if (node.IsNull()) return;
  for (const Entry& entry : Map(node, "free", hint)) {
    spec->free.push_back(ReadFreeEntry(entry));
  }
}

void Reader::ReadFix(const YAML::Node& node, FitSpecification* spec) const {
  const std::string hint = "write fix: {link1.mass: 1.0}, or a list of names";
  if (node.IsSequence()) {
    for (const auto& name : NameList(node, "fix", hint)) {
      spec->fix.push_back({name.value, std::nullopt, name.place});
    }
  } else if (!node.IsNull()) {
    for (const auto& [key, value] : Map(node, "fix", hint)) {
      FitSpecification::Fix fix{key.Scalar(), std::nullopt, Place(key)};
      if (!value.IsNull()) fix.value = Number(value, fix.name);
      spec->fix.push_back(fix);
    }
  }
  for (const FitSpecification::Fix& fix : spec->fix) {
    for (const FitSpecification::Free& free : spec->free) {
      if (fix.name != free.name) continue;
      throw InputError(fix.place, Shown(fix.name) + " is both free and fixed",
                       "keep one of them");
    }
  }
}

void Reader::ReadColumns(const YAML::Node& node, FitSpecification* spec) const {
  if (node.IsNull()) return;
  const std::string hint = "write columns: {t: time, joint1.q: pos1}";
  for (const Entry& entry : Map(node, "columns", hint)) {
    CheckValue(entry);
    const auto& [key, value] = entry;
    spec->columns.push_back({key.Scalar(),
                             Text(value, "the column of " + key.Scalar(), hint),
                             Place(key)});
  }
}

Located<FitSpecification::Loss> Reader::ReadLoss(const YAML::Node& node) const {
  Located<FitSpecification::Loss> loss;
  loss.place = Place(node);
  if (!node.IsMap()) {
    loss.value.name = Word(node, "loss", LossNames()).value;
    return loss;
  }
  for (const Entry& entry : Map(node, "loss", "")) {
    const auto& [key, value] = entry;
    CheckKey(key, "loss", {"name", "scale"});
    CheckValue(entry);
    if (key.Scalar() == "name") {
      loss.value.name = Word(value, "loss", LossNames()).value;
    } else {
      loss.value.scale = Positive(value, "scale of loss").value;
    }
  }
  if (loss.value.name.empty()) {
    Fail(node, "loss has no name", "write loss: {name: huber, scale: 1.5}");
  }
  return loss;
}

// A word without a slash and without ".urdf" is a shipped model's name.
std::string Reader::ResolveModel(const std::string& model) const {
  const bool is_file =
      model.find('/') != std::string::npos || model.ends_with(".urdf");
  if (!is_file) return model;
  const std::filesystem::path folder =
      std::filesystem::path(path()).parent_path();
  return (folder / model).lexically_normal().string();
}

void Reader::ReadTop(const Entry& entry, FitSpecification* spec) const {
  const auto& [key, value] = entry;
  CheckKey(key, "the specification", TopKeys());
  const std::string& name = key.Scalar();
  const bool may_be_empty =
      name == "free" || name == "fix" || name == "effects" || name == "columns";
  if (!may_be_empty) CheckValue(entry);
  if (name == "model") {
    spec->model = {ResolveModel(Text(value, "model")), Place(value)};
  } else if (name == "free") {
    ReadFree(value, spec);
  } else if (name == "fix") {
    // Last: it is compared with free.
  } else if (name == "effects") {
    const std::string hint = "write effects: [coulomb_friction@joint1]";
    if (value.IsNull()) return;
    spec->effects = NameList(value, "effects", hint);
  } else if (name == "columns") {
    ReadColumns(value, spec);
  } else if (name == "shift") {
    spec->edits.shifts = ParseShifts(Text(value, name), Place(value));
  } else if (name == "ignore") {
    spec->edits.ignored = ParseIgnored(Text(value, name), Place(value));
  } else if (name == "noise") {
    spec->noise = Positive(value, name);
  } else if (name == "step") {
    spec->step = Positive(value, name);
  } else if (name == "segment") {
    spec->segment = Positive(value, name);
  } else if (name == "integrator") {
    spec->integrator = Word(value, name, IntegratorNames());
  } else if (name == "residual") {
    spec->residual = Word(value, name, ResidualNames());
  } else if (name == "solver") {
    spec->solver = Word(value, name, SolverNames());
  } else {  // loss
    spec->loss = ReadLoss(value);
  }
}

FitSpecification Reader::Read(const std::string& text) {
  FitSpecification spec;
  spec.path = path();
  const YAML::Node root = Load(text);
  if (root.IsNull()) return spec;
  const std::vector<Entry> entries =
      Map(root, "the specification",
          "write key: value; known keys: " + Join(TopKeys()));
  for (const Entry& entry : entries) ReadTop(entry, &spec);
  for (const auto& [key, value] : entries) {
    if (key.Scalar() == "fix") ReadFix(value, &spec);
  }
  return spec;
}

}  // namespace

const std::vector<std::string>& IntegratorNames() {
  static const auto& names =
      *new std::vector<std::string>{"semi_implicit_euler", "rk4"};
  return names;
}

const std::vector<std::string>& ResidualNames() {
  static const auto& names =
      *new std::vector<std::string>{"heading", "rotation"};
  return names;
}

const std::vector<std::string>& SolverNames() {
  static const auto& names = *new std::vector<std::string>{"lm", "adam", "gmm"};
  return names;
}

const std::vector<std::string>& LossNames() {
  static const auto& names =
      *new std::vector<std::string>{"none", "huber", "cauchy"};
  return names;
}

FitSpecification ParseFitSpecification(const std::string& path,
                                       const std::string& text) {
  return Reader(path).Read(text);
}

FitSpecification ReadFitSpecification(const std::string& path) {
  return ParseFitSpecification(path, ReadTextFile(path));
}

}  // namespace sysid
