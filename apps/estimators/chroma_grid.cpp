#include "apps/estimators/chroma_grid.h"

#include "core/error.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::apps {
namespace {

constexpr int kFewest = 2;
constexpr int kMost = 64;

}  // namespace

void add_grid_option(CLI::App& command, std::string& text) {
  command.add_option("--grid", text, "Markers as COLUMNSxROWS")->capture_default_str();
}

Eigen::Vector2i grid_of(const std::string& text) {
  const std::size_t cross = text.find('x');
  const auto count = [&](const std::string& part) {
    const auto value = datasets::number_of<int>(part);
    if (!value || *value < kFewest || *value > kMost) {
      fail("--grid: '{}' must be COLUMNSxROWS, each from {} to {}, as 10x10", text, kFewest, kMost);
    }
    return *value;
  };
  const int columns = count(text.substr(0, cross));
  return {columns, count(cross == std::string::npos ? "" : text.substr(cross + 1))};
}

}  // namespace touchstone::apps
