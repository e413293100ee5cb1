// What every program of tests begins with. A folder's tests are one program (cmake/TouchstoneTargets.cmake), and
// --sources=a_test.cpp,b_test.cpp runs those cases that stand in these files; --gtest_filter then chooses among all
// cases instead. --without=A.B,C.D leaves these cases out, which --only=A.B,C.D runs: long ones, for which ctest has a
// test of their own. A name may stand for all instances of a parametrized case.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>

namespace {

/// Whether `file`, as the compiler was given it, is `source`, a path relative to the folder of tests.
bool is_source(std::string_view file, std::string_view source) {
  if (!file.ends_with(source)) return false;
  return file.size() == source.size() || file[file.size() - source.size() - 1] == '/';
}

[[noreturn]] void refuse(const std::string& names) {
  std::fprintf(stderr, "'%s' stands for no case\n", names.c_str());
  std::exit(2);
}

/// GoogleTest's filter for all cases that one of `names`, with commas between, chooses. Ends the program where they
/// choose none; `every`: where one of them does.
template <typename Chosen>
std::string filter_of(const std::string& names, bool every, const Chosen& chosen) {
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  std::string filter;
  std::istringstream each(names);
  for (std::string name; std::getline(each, name, ',');) {
    const std::size_t before = filter.size();
    for (int s = 0; s < all.total_test_suite_count(); ++s) {
      const testing::TestSuite& suite = *all.GetTestSuite(s);
      for (int t = 0; t < suite.total_test_count(); ++t) {
        const testing::TestInfo& test = *suite.GetTestInfo(t);
        if (chosen(test, name)) filter += std::string(suite.name()) + "." + test.name() + ":";
      }
    }
    if (every && filter.size() == before) refuse(name);
  }
  if (filter.empty()) refuse(names);
  return filter;
}

bool is_in(const testing::TestInfo& test, const std::string& source) {
  return is_source(test.file(), source);
}

/// `name` is that of a case, or, of a parametrized one, without the instance before and the parameter behind.
bool is_called(const testing::TestInfo& test, const std::string& name) {
  const std::string full = std::string(test.test_suite_name()) + "." + test.name();
  return full == name || (test.value_param() != nullptr && ("/" + full).find("/" + name + "/") != std::string::npos);
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  const bool all = GTEST_FLAG_GET(filter) == "*";
  std::string filter, without;
  for (int k = 1; k < argc; ++k) {
    const std::string argument = argv[k];
    const std::string names = argument.substr(std::min(argument.find('=') + 1, argument.size()));
    if (argument.starts_with("--sources=")) {
      filter += filter_of(names, false, is_in);
    } else if (argument.starts_with("--only=")) {
      filter += filter_of(names, true, is_called);
    } else if (argument.starts_with("--without=")) {
      without = "-" + filter_of(names, true, is_called);
    } else {
      std::fprintf(stderr,
                   "%s: '%s' isn't known; allowed are --sources=FILE,..., --without=CASE,..., --only=CASE,... and "
                   "GoogleTest's\n",
                   argv[0], argv[k]);
      return 2;
    }
  }
  if (all && !(filter + without).empty()) GTEST_FLAG_SET(filter, filter + without);
  return RUN_ALL_TESTS();
}
