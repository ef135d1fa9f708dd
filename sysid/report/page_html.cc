#include <string_view>

#include "sysid/report/page_data.h"

#ifdef SYSID_PAGE
// The page as npm built it (cmake/SysidWeb.cmake).
asm(R"(
  .pushsection .rodata
  .global sysid_page_begin
sysid_page_begin:
  .incbin ")" SYSID_PAGE R"("
  .global sysid_page_end
sysid_page_end:
  .byte 0
  .popsection
)");
extern "C" const char sysid_page_begin[], sysid_page_end[];
#endif

namespace sysid {
namespace {

// JSON within a script element, which "</script" and "<!--" would end or bend:
// any "<" stands in a string, where JSON lets it be written so. Older engines
// take the separators for ends of lines.
std::string Embeddable(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (size_t i = 0; i < json.size(); ++i) {
    const std::string_view rest(json.data() + i, json.size() - i);
    if (rest[0] == '<') {
      text += "\\u003c";
    } else if (rest.starts_with("\u2028") || rest.starts_with("\u2029")) {
      text += rest.starts_with("\u2028") ? "\\u2028" : "\\u2029";
      i += 2;
    } else {
      text += rest[0];
    }
  }
  return text;
}

}  // namespace

std::string LivePage() {
#ifdef SYSID_PAGE
  return {sysid_page_begin, sysid_page_end};
#else
  return "";
#endif
}

std::string WhyNoPage() {
#ifdef SYSID_PAGE
  return "";
#else
  return SYSID_PAGE_MISSING;
#endif
}

std::string ReportHtml(const Json& page) {
  const std::string element =
      "<script id=\"page-data\" "
      "type=\"application/json\">";
  std::string html = LivePage();
  const size_t at = html.find(element);
  if (at == std::string::npos) return "";
  return html.insert(at + element.size(), Embeddable(Compact(page)));
}

}  // namespace sysid
