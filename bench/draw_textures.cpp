// docs/images/gelsight-textures.png: a piece of each texture object as the sensor's pixels see it, lit from above left.
// Usage: draw_textures OUT.png

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "datasets/inspection/contact_sheet.h"
#include "lab/gelsight/gelsight_texture_experiment.h"
#include "sim/files/image_file.h"

namespace touchstone {
namespace {

constexpr int kSide = 200;
constexpr double kPixel_mm = 0.027;

/// Matt shading of the heights by a low light from above left, plus a little of the height itself.
cv::Mat lit(const fem::ReliefMap& map) {
  cv::Mat picture(kSide, kSide, CV_8U);
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const double x = i * kPixel_mm, y = -j * kPixel_mm;
      const double here = map.at(x, y);
      const double right = (map.at(x + kPixel_mm, y) - here) / kPixel_mm;
      const double up = (map.at(x, y + kPixel_mm) - here) / kPixel_mm;
      const double shade = (0.45 * right - 0.45 * up + 0.77) / std::sqrt(1.0 + right * right + up * up);
      const double share = 0.7 * std::max(0.0, shade) + 0.3 * here / map.highest();
      picture.at<std::uint8_t>(j, i) = cv::saturate_cast<std::uint8_t>(255.0 * share);
    }
  }
  return picture;
}

}  // namespace
}  // namespace touchstone

int main(int argc, char** argv) {
  using namespace touchstone;
  if (argc != 2) {
    std::fprintf(stderr, "usage: draw_textures OUT.png\n");
    return 2;
  }
  try {
    std::vector<cv::Mat> pictures;
    std::vector<std::string> captions;
    for (const sim::ObjectSpec& object :
         lab::texture_objects(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes")) {
      pictures.push_back(lit(sim::relief_map(*object.relief)));
      captions.push_back(object.name);
    }
    constexpr int kColumns = 8, kTile_px = 100;
    cv::Mat sheet = datasets::contact_sheet(pictures, captions, kColumns, kTile_px);
    cv::extractChannel(sheet, sheet, 0);  // it's grey
    sim::write_png(argv[1], sheet);
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
