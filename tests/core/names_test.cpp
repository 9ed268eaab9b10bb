#include "asperity/core/names.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <type_traits>

#include "asperity/core/formulation.h"
#include "asperity/core/result.h"
#include "asperity/core/samples.h"

namespace asperity {

/// Not in the order of its values, and without a name for one of them.
enum class Fruit : std::uint8_t { apple, pear, plum, quince };
template <>
struct Names<Fruit> {
  static constexpr auto table =
      std::to_array<Named<Fruit>>({{Fruit::plum, "plum"}, {Fruit::apple, "apple"}, {Fruit::pear, "pear"}});
};

enum class Clash { one, two };
template <>
struct Names<Clash> {
  static constexpr auto table = std::to_array<Named<Clash>>({{Clash::one, "same"}, {Clash::two, "same"}});
};

namespace {

enum class Nameless { none };
static_assert(HasNames<Fruit> && !HasNames<Nameless> && !HasNames<int>);
static_assert(std::is_same_v<decltype(to_string(Fruit::plum)), const char*>);
static_assert(std::string_view(to_string(Fruit::pear)) == "pear");
static_assert(names_differ<Fruit>() && !names_differ<Clash>());

TEST(Names, GoBothWays) {
  for (const Named<Fruit>& entry : Names<Fruit>::table) {
    EXPECT_STREQ(to_string(entry.value), entry.name);
    EXPECT_EQ(value_named<Fruit>(entry.name), entry.value);
    EXPECT_EQ(Names<Fruit>::table[place_of_name(entry.value)].value, entry.value);
  }
}

TEST(Names, WhatHasNoneIsUnknown) {
  EXPECT_STREQ(to_string(Fruit::quince), "unknown");
  EXPECT_STREQ(to_string(static_cast<Fruit>(200)), "unknown");
  EXPECT_EQ(place_of_name(Fruit::quince), Names<Fruit>::table.size());
  for (const char* name : {"", "Plum", "plum ", "quince", "unknown"}) EXPECT_FALSE(value_named<Fruit>(name)) << name;
}

TEST(Names, AreListedInTheTablesOrder) {
  EXPECT_EQ(all_names<Fruit>(), (std::vector<std::string>{"plum", "apple", "pear"}));
  EXPECT_EQ(name_list<Fruit>(), "plum, apple, pear");
  EXPECT_EQ(listed({}), "");
  EXPECT_EQ(listed({"one"}), "one");
  EXPECT_EQ(name_list<Fruit>("'"), "'plum', 'apple', 'pear'");
  EXPECT_EQ(name_list<Fruit>("\"", " or "), "\"plum\", \"apple\" or \"pear\"");
  EXPECT_EQ(listed({"one", "two"}, "", " or "), "one or two");
}

TEST(Names, EveryFlagOfATickHasOneAtItsBit) {
  const auto& table = Names<TickFlag>::table;
  EXPECT_TRUE(names_differ<TickFlag>());
  for (std::size_t bit = 0; bit < table.size(); ++bit)
    EXPECT_EQ(static_cast<std::uint32_t>(table[bit].value), std::uint32_t{1} << bit) << table[bit].name;
}

TEST(Names, EveryCauseHasOne) {
  EXPECT_TRUE(names_differ<ErrorCode>());
  EXPECT_EQ(Names<ErrorCode>::table.size(), static_cast<std::size_t>(ErrorCode::mismatch) + 1);
  EXPECT_STREQ(to_string(Formulation::literal), "literal");
}

}  // namespace
}  // namespace asperity
