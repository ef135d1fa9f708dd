#include "sysid/parameters/yaml_reader.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "models/error.h"
#include "sysid/io/csv.h"

namespace sysid {
namespace {

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

}  // namespace

// YAML::Load takes the first document and is silent about the rest; what cannot
// stand in a document (a comma at its start) is an endless row of empty ones to
// YAML::LoadAll.
void YamlReader::CheckOneDocument(const std::string& text) const {
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
    throw InputError(Place(mark), "a second document begins here",
                     "a specification is one document: remove the '---'");
  }
  throw InputError(Place(mark),
                   "is not YAML: " + Shown(rest) + " cannot stand here",
                   kYamlHint);
}

YAML::Node YamlReader::Load(const std::string& text) const {
  // The comment makes yaml-cpp notice a quote that is open at the end.
  const std::string closed = text + "\n#";
  try {
    CheckOneDocument(closed);
    return YAML::Load(closed);
  } catch (const YAML::Exception& error) {
    throw InputError(Place(Within(error.mark, text)),
                     "is not YAML: " + error.msg, kYamlHint);
  }
}

std::string YamlReader::Place(const YAML::Mark& mark) const {
  if (mark.is_null()) return path_;
  return path_ + ":" + std::to_string(mark.line + 1) + ":" +
         std::to_string(mark.column + 1);
}

std::string YamlReader::Place(const YAML::Node& node) const {
  return Place(node.Mark());
}

void YamlReader::Fail(const YAML::Node& node, const std::string& what,
                      const std::string& hint) const {
  throw InputError(Place(node), what, hint);
}

std::string YamlReader::KindOf(const YAML::Node& node) {
  if (node.IsMap()) return "a map";
  if (node.IsSequence()) return "a list";
  if (node.IsScalar()) return Shown(node.Scalar());
  return "nothing";
}

std::vector<YamlReader::Entry> YamlReader::Map(const YAML::Node& node,
                                               const std::string& what,
                                               const std::string& hint) const {
  if (!node.IsMap()) {
    Fail(node, what + " must be a map, not " + KindOf(node), hint);
  }
  std::vector<Entry> entries;
  std::set<std::string> seen;
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) {
      Fail(pair.first,
           "a key of " + what + " must be a name, not " + KindOf(pair.first));
    }
    if (pair.first.Scalar().empty()) {
      Fail(pair.first, "a key of " + what + " is empty", "write a name");
    }
    if (!seen.insert(pair.first.Scalar()).second) {
      Fail(pair.first,
           Shown(pair.first.Scalar()) + " is given twice in " + what,
           "keep one of them");
    }
    entries.emplace_back(pair.first, pair.second);
  }
  return entries;
}

void YamlReader::CheckValue(const Entry& entry) const {
  if (!entry.second.IsNull()) return;
  Fail(entry.first, Shown(entry.first.Scalar()) + " has no value");
}

void YamlReader::CheckKey(const YAML::Node& key, const std::string& of,
                          const std::vector<std::string>& known) const {
  for (const std::string& name : known) {
    if (key.Scalar() == name) return;
  }
  Fail(key, "unknown key " + Shown(key.Scalar()) + " in " + of,
       NameHint(key.Scalar(), known));
}

std::string YamlReader::Text(const YAML::Node& node, const std::string& what,
                             const std::string& hint) const {
  if (!node.IsScalar() || node.Scalar().empty()) {
    Fail(node,
         what + " must be text, not " +
             (node.IsScalar() ? "nothing" : KindOf(node)),
         hint);
  }
  return node.Scalar();
}

double YamlReader::Number(const YAML::Node& node,
                          const std::string& what) const {
  double value;
  if (!node.IsScalar() || !ParseNumber(node.Scalar(), &value)) {
    Fail(node, what + " must be a number, not " + KindOf(node));
  }
  if (!std::isfinite(value)) {
    Fail(node, what + " must be finite, not " + KindOf(node));
  }
  return value;
}

Located<double> YamlReader::Positive(const YAML::Node& node,
                                     const std::string& what) const {
  const double value = Number(node, what);
  if (value <= 0.0) Fail(node, what + " must be positive, not " + KindOf(node));
  return {value, Place(node)};
}

Located<std::string> YamlReader::Word(
    const YAML::Node& node, const std::string& what,
    const std::vector<std::string>& known) const {
  const std::string word = Text(node, what, "known: " + Join(known));
  for (const std::string& name : known) {
    if (word == name) return {word, Place(node)};
  }
  Fail(node, "there is no " + what + " " + Shown(word), NameHint(word, known));
}

std::vector<Located<std::string>> YamlReader::NameList(
    const YAML::Node& node, const std::string& what,
    const std::string& hint) const {
  if (!node.IsSequence()) {
    Fail(node, what + " must be a list, not " + KindOf(node), hint);
  }
  std::vector<Located<std::string>> names;
  std::set<std::string> seen;
  for (const YAML::Node& item : node) {
    const std::string name = Text(item, "an entry of " + what, hint);
    if (!seen.insert(name).second) {
      Fail(item, Shown(name) + " is given twice in " + what,
           "keep one of them");
    }
    names.push_back({name, Place(item)});
  }
  return names;
}

}  // namespace sysid
