#include "sysid/fleet/result_keys.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "models/error.h"

namespace sysid {

ResultKeys ResultKeys::Read(const std::string& file, const std::string& hint) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (!fs::exists(file, error)) {
    throw InputError(file, "there is no such file", hint);
  }
  if (fs::is_directory(file, error)) {
    throw InputError(file, "is a folder, not a file", "name the file in it");
  }
  std::ifstream in(file);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf())) {
    throw InputError(file, "cannot be read, or is empty", hint);
  }
  const std::optional<Json> json = ParseJson(text.str());
  if (!json) throw InputError(file, "is no JSON; is it cut off?", hint);
  return ResultKeys(file, hint, "", *json);
}

void ResultKeys::Fail(const std::string& path, const std::string& what) const {
  throw InputError(file_, "key " + path + " " + what, hint_);
}

std::string ResultKeys::Path(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

const Json& ResultKeys::Value(const std::string& key) const {
  if (!json_.is_object()) Fail(path_.empty() ? key : path_, "is no object");
  const auto at = json_.find(key);
  if (at == json_.end()) Fail(Path(key), "is missing");
  return *at;
}

std::string ResultKeys::CheckSchema(
    const std::vector<std::string>& known) const {
  const std::string schema = Text("schema");
  if (std::find(known.begin(), known.end(), schema) == known.end()) {
    Fail("schema", "is '" + schema + "', not " + Join(known, " or "));
  }
  return schema;
}

bool ResultKeys::Has(const std::string& key) const {
  return json_.is_object() && json_.contains(key);
}

bool ResultKeys::IsNull(const std::string& key) const {
  return Value(key).is_null();
}

ResultKeys ResultKeys::At(const std::string& key) const {
  return ResultKeys(file_, hint_, Path(key), Value(key));
}

std::vector<ResultKeys> ResultKeys::Items() const {
  if (!json_.is_array()) Fail(path_, "is no list");
  std::vector<ResultKeys> items;
  for (size_t i = 0; i < json_.size(); ++i) {
    items.push_back(ResultKeys(
        file_, hint_, path_ + "[" + std::to_string(i) + "]", json_[i]));
  }
  return items;
}

std::string ResultKeys::Text(const std::string& key) const {
  const Json& value = Value(key);
  if (!value.is_string()) Fail(Path(key), "is no text");
  return value.get<std::string>();
}

double ResultKeys::Number(const std::string& key) const {
  const Json& value = Value(key);
  if (value.is_null()) return std::numeric_limits<double>::quiet_NaN();
  if (!value.is_number()) Fail(Path(key), "is no number");
  return value.get<double>();
}

bool ResultKeys::Flag(const std::string& key) const {
  const Json& value = Value(key);
  if (!value.is_boolean()) Fail(Path(key), "is neither true nor false");
  return value.get<bool>();
}

std::vector<std::string> ResultKeys::Texts(const std::string& key) const {
  return At(key).Texts();
}

std::vector<std::string> ResultKeys::Texts() const {
  std::vector<std::string> texts;
  for (const ResultKeys& item : Items()) {
    if (!item.json_.is_string()) Fail(item.path_, "is no text");
    texts.push_back(item.json_.get<std::string>());
  }
  return texts;
}

}  // namespace sysid
