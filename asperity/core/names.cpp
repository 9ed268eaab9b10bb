#include "asperity/core/names.h"

namespace asperity {

std::string listed(const std::vector<std::string>& names, std::string_view quote, std::string_view last) {
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) list += i + 1 == names.size() ? last : ", ";
    list.append(quote).append(names[i]).append(quote);
  }
  return list;
}

}  // namespace asperity
