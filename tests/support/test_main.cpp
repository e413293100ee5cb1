// What every program of tests begins with. A folder's tests are one program (cmake/TouchstoneTargets.cmake), and
// --sources=a_test.cpp,b_test.cpp runs those cases that stand in these files; --gtest_filter then chooses among all
// cases instead.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <sstream>
#include <string>
#include <string_view>

namespace {

/// Whether `file`, as the compiler was given it, is `source`, a path relative to the folder of tests.
bool is_source(std::string_view file, std::string_view source) {
  if (!file.ends_with(source)) return false;
  return file.size() == source.size() || file[file.size() - source.size() - 1] == '/';
}

/// GoogleTest's filter for the cases of `sources`, names with commas between; empty where none has any.
std::string filter_of(const std::string& sources) {
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  std::string filter;
  std::istringstream names(sources);
  for (std::string source; std::getline(names, source, ',');) {
    for (int s = 0; s < all.total_test_suite_count(); ++s) {
      const testing::TestSuite& suite = *all.GetTestSuite(s);
      for (int t = 0; t < suite.total_test_count(); ++t) {
        const testing::TestInfo& test = *suite.GetTestInfo(t);
        if (is_source(test.file(), source)) filter += std::string(suite.name()) + "." + test.name() + ":";
      }
    }
  }
  return filter;
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  constexpr std::string_view kSources = "--sources=";
  for (int k = 1; k < argc; ++k) {
    const std::string_view argument = argv[k];
    if (!argument.starts_with(kSources)) {
      std::fprintf(stderr, "%s: '%s' isn't known; allowed are --sources=FILE,FILE,... and GoogleTest's\n", argv[0],
                   argv[k]);
      return 2;
    }
    if (GTEST_FLAG_GET(filter) != "*") continue;
    const std::string filter = filter_of(std::string(argument.substr(kSources.size())));
    if (filter.empty()) {
      std::fprintf(stderr, "%s: no case stands in any of %s\n", argv[0], argv[k] + kSources.size());
      return 2;
    }
    GTEST_FLAG_SET(filter, filter);
  }
  return RUN_ALL_TESTS();
}
