#include "sysid/studio/parse_json.h"

#include <utility>

namespace sysid {

std::optional<Json> ParseJson(const std::string& text) {
  bool too_deep = false;
  const auto keep = [&](int depth, Json::parse_event_t event, const Json&) {
    using Event = Json::parse_event_t;
    // Of what is open already when this opens.
    if (depth >= kMostJsonDepth &&
        (event == Event::object_start || event == Event::array_start)) {
      too_deep = true;
    }
    return !too_deep;
  };
  Json json = Json::parse(text, keep, false);
  if (too_deep || json.is_discarded()) return {};
  return json;
}

}  // namespace sysid
