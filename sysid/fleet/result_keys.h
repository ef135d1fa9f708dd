#pragma once

#include <string>
#include <vector>

#include "sysid/report/json.h"

namespace sysid {

// A value within a file of ours, which knows where it is: every member throws
// InputError "fit.json: key error.train: is missing", with a hint, where the
// file is not as docs/interface.md section 6 says.
class ResultKeys {
 public:
  // Throws InputError for a file that is missing or no JSON; `hint` says what
  // writes it.
  static ResultKeys Read(const std::string& file, const std::string& hint);

  // The schema, which is one of these.
  std::string CheckSchema(const std::vector<std::string>& known) const;

  bool Has(const std::string& key) const;
  bool IsNull(const std::string& key) const;
  ResultKeys At(const std::string& key) const;
  std::vector<ResultKeys> Items() const;  // of a list
  std::string Text(const std::string& key) const;
  double Number(const std::string& key) const;  // null: NaN
  bool Flag(const std::string& key) const;
  std::vector<std::string> Texts(const std::string& key) const;
  std::vector<std::string> Texts() const;

 private:
  ResultKeys(const std::string& file, const std::string& hint,
             const std::string& path, const Json& json)
      : file_(file), hint_(hint), path_(path), json_(json) {}
  [[noreturn]] void Fail(const std::string& path,
                         const std::string& what) const;
  std::string Path(const std::string& key) const;
  const Json& Value(const std::string& key) const;

  std::string file_, hint_, path_;
  Json json_;
};

}  // namespace sysid
