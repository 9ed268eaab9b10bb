#include "asperity/study/detail/page.h"

#include <fmt/format.h>

#include "asperity/study/detail/report_assets.h"

namespace asperity {
namespace {

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

/// JSON that cannot end the script element it stands in, whatever its texts hold. Bytes that are not UTF-8 are
/// replaced.
std::string script_json(const nlohmann::json& data) {
  std::string text = data.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  replace_all(text, "<", "\\u003c");
  replace_all(text, ">", "\\u003e");
  replace_all(text, "&", "\\u0026");
  replace_all(text, "\xE2\x80\xA8", "\\u2028");
  replace_all(text, "\xE2\x80\xA9", "\\u2029");
  return text;
}

/// An asset without the line that would send a browser looking for its source map.
std::string asset(std::size_t index) {
  std::string text(report_assets()[index].text);
  const std::size_t at = text.rfind("# sourceMappingURL=");
  if (at != std::string::npos && at >= 2) text.erase(at - 2);
  return text;
}

}  // namespace

std::string escaped_html(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      case '\'': out += "&#39;"; break;
      default: out += c;
    }
  }
  return out;
}

std::string page_html(const std::string& title, const nlohmann::json& data, std::size_t script,
                      const std::string& extra) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n"
      "<style>{}\n{}</style>\n</head>\n<body>\n<main id=\"page\"></main>\n<div id=\"picture-store\" hidden>{}</div>\n"
      "<noscript><p>This page draws its tables and plots with a script that it carries itself. Scripts are turned "
      "off.</p></noscript>\n"
      "<script type=\"application/json\" "
      "id=\"data\">{}</script>\n<script>{}</script>\n<script>{}</script>\n</body>\n</html>\n",
      escaped_html(title), asset(3), asset(1), extra, script_json(data), asset(2), asset(script));
}

}  // namespace asperity
