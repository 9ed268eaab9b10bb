#pragma once
// One HTML file from a title, the data and a script that draws it. Private to study.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace asperity {

/// Text as it may stand in HTML.
std::string escaped_html(std::string_view text);

/// A page that holds its data, the plot library, the house's style and one of the scripts of report_assets() (its
/// index there). `extra`: HTML that is hidden until the script takes it.
std::string page_html(const std::string& title, const nlohmann::json& data, std::size_t script,
                      const std::string& extra);

}  // namespace asperity
