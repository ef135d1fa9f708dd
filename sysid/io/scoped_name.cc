#include "sysid/io/scoped_name.h"

#include <filesystem>

namespace sysid {

bool ScopedName::IsFor(const std::string& path) const {
  return run.empty() || run == path ||
         run == std::filesystem::path(path).filename().string();
}

ScopedName SplitScope(const std::string& text,
                      const std::function<bool(const std::string&)>& is_name) {
  if (is_name(text)) return {"", text};
  for (size_t slash = text.find('/'); slash != std::string::npos;
       slash = text.find('/', slash + 1)) {
    if (is_name(text.substr(slash + 1))) {
      return {text.substr(0, slash), text.substr(slash + 1)};
    }
  }
  const size_t last = text.rfind('/');
  if (last == std::string::npos) return {"", text};
  return {text.substr(0, last), text.substr(last + 1)};
}

}  // namespace sysid
