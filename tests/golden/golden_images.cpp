// Renews the golden images, or shows them; script/golden calls it.
//   golden_images compare [NAME...]        z-test of each stored picture against a rendering
//   golden_images renew [NAME...]          renders anew what fails that test or isn't there, and says what changed
//   golden_images view FOLDER              each stored picture as a PNG
//   golden_images renew-all                every one, whether it fails or not

#include <fmt/core.h>

#include <exception>
#include <string>
#include <vector>

#include "core/error.h"
#include "sim/files/image_file.h"
#include "tests/golden/golden_files.h"
#include "tests/golden/golden_scenes.h"

namespace touchstone::golden {
namespace {

void renew(const GoldenScene& golden) {
  std::filesystem::create_directories(file_of(golden.name).parent_path());
  write_statistics(file_of(golden.name), reference_rendering(golden));
}

int run(const std::vector<std::string>& words) {
  const std::string mode = words.empty() ? "compare" : words[0];
  if (mode == "view") {
    if (words.size() != 2) fail("golden_images view FOLDER");
    std::filesystem::create_directories(words[1]);
    for (const std::string& name : golden_names()) {
      sim::write_png(std::filesystem::path(words[1]) / (name + ".png"),
                     picture_of(read_statistics(file_of(name)).mean));
    }
    return 0;
  }
  if (mode != "compare" && mode != "renew" && mode != "renew-all") fail("golden_images: {} isn't known", mode);
  std::vector<std::string> names(words.begin() + (words.empty() ? 0 : 1), words.end());
  if (names.empty()) names = golden_names();
  int failed = 0;
  for (const std::string& name : names) {
    const GoldenScene golden = golden_scene(name);
    if (!std::filesystem::exists(file_of(name))) {
      fmt::print("{}: there is none yet\n", name);
      ++failed;
      if (mode != "compare") renew(golden);
      continue;
    }
    const Comparison comparison = compare(read_statistics(file_of(name)), test_rendering(golden));
    fmt::print("{}: {}\n", name, comparison.text());
    if (!comparison.passes()) ++failed;
    if (mode == "renew-all" || (mode == "renew" && !comparison.passes())) {
      renew(golden);
      fmt::print("{}: renewed\n", name);
    }
  }
  return mode == "compare" && failed > 0 ? 1 : 0;
}

}  // namespace
}  // namespace touchstone::golden

int main(int count, char** words) {
  try {
    return touchstone::golden::run({words + 1, words + count});
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
