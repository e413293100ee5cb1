#include "lab/vhs/region_table.h"

#include <opencv2/core.hpp>
#include <set>

#include "core/cie_colour.h"
#include "datasets/sets/csv_cells.h"
#include "sensors/skin/colour_model.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

const std::string kPatchPlace = "file,left_px,top_px,width_px,height_px,";
constexpr const char* kRegionColumns = "region,left_px,top_px,width_px,height_px";

/// The rectangle in the four cells from `at` on.
cv::Rect rectangle_in(const std::vector<std::string>& cells, std::size_t at, const SourceLocation& where) {
  const auto number = [&](std::size_t offset, const char* field, int least) {
    const int value = datasets::whole_number_in<int>(cells[at + offset], field, where);
    if (value < least) fail_at(where, "{}: is {}, it must be at least {}", field, value, least);
    return value;
  };
  return {number(0, "left_px", 0), number(1, "top_px", 0), number(2, "width_px", 1), number(3, "height_px", 1)};
}

/// The known colour in the last three cells.
Eigen::Vector3d colour_in(const std::vector<std::string>& cells, bool srgb, const SourceLocation& where) {
  const auto number = [&](std::size_t at, const char* field, double low, double high) {
    const double value = datasets::number_in(cells[at], field, where);
    if (value < low || value > high) fail_at(where, "{}: is {}, it must be from {} to {}", field, value, low, high);
    return value;
  };
  if (srgb) {
    return lab_from_srgb(
        Eigen::Vector3d(number(5, "red", 0, 255), number(6, "green", 0, 255), number(7, "blue", 0, 255)) / 255.0);
  }
  return {number(5, "L", 0, 100), number(6, "a", -200, 200), number(7, "b", -200, 200)};
}

}  // namespace

std::vector<KnownPatch> read_patch_table(datasets::TableFrames& frames, const fs::path& csv) {
  const std::string head = datasets::header_among(csv, {kPatchPlace + "L,a,b", kPatchPlace + "red,green,blue"});
  const bool srgb = head.ends_with("blue");
  std::vector<KnownPatch> patches;
  datasets::for_each_row(csv, head, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    patches.push_back(
        {frames.named(cells[0], where), rectangle_in(cells, 1, where), colour_in(cells, srgb, where), where});
  });
  if (patches.empty()) fail("{}: has no patch", csv.string());
  return patches;
}

std::vector<NamedRegion> read_region_table(const fs::path& csv, const cv::Size& size) {
  std::vector<NamedRegion> regions;
  std::set<std::string> names;
  datasets::for_each_row(csv, kRegionColumns, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    if (cells[0].empty()) fail_at(where, "region: is empty");
    if (!names.insert(cells[0]).second) fail_at(where, "region: '{}' stands there twice", cells[0]);
    const cv::Rect place = rectangle_in(cells, 1, where);
    try {
      regions.push_back({cells[0], sensors::rectangle_mask(size, place)});
    } catch (const Error& error) {
      fail_at(where, "{}", error.what());
    }
  });
  if (regions.empty()) fail("{}: has no region", csv.string());
  return regions;
}

}  // namespace touchstone::lab
