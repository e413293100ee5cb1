#include "sim/relief/image_relief.h"

#include <algorithm>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/units.h"
#include "sim/files/image_file.h"
#include "sim/relief/wave_reliefs.h"

namespace touchstone::sim {
namespace {

/// The picture as shares of white, 32 bit floats.
cv::Mat read_shares(const ImageRelief& relief) {
  try {
    const bool floats = relief.file.extension() == ".exr";
    cv::Mat picture = floats ? read_exr(relief.file).image : read_image(relief.file);
    if (picture.channels() != 1)
      fail("{}: has {} channels; a relief is grey", relief.file.string(), picture.channels());
    cv::Mat shares;
    picture.convertTo(shares, CV_32F,
                      picture.depth() == CV_8U    ? 1.0 / 255
                      : picture.depth() == CV_16U ? 1.0 / 65535
                                                  : 1.0);
    return shares;
  } catch (const Error& error) {
    fail_at(relief.where, "relief.file: {}", error.what());
  }
}

}  // namespace

void fields(YamlReader& in, ImageRelief& relief) {
  in.required("amplitude_um", relief.amplitude_um, Allowed::above_up_to(0.0, kHighestRelief_um));
  std::string file;
  in.required("file", file);
  relief.file = in.folder() / file;
  relief.where = in.where("file");
  in.required("size_mm", relief.size_mm, Allowed::above_up_to(0.0, 1000.0));
  in.optional("repeat", relief.repeat);
}

fem::ReliefMap relief_map(const ImageRelief& relief) {
  const cv::Mat shares = read_shares(relief);
  const double amplitude = relief.amplitude_um / kMicrometresPerMillimetre;
  const Eigen::Vector2d spacing(relief.size_mm.x() / shares.cols, relief.size_mm.y() / shares.rows);
  std::vector<float> heights;
  heights.reserve(shares.total());
  for (int j = 0; j < shares.rows; ++j) {  // the picture's rows run down, the map's up
    const float* row = shares.ptr<float>(shares.rows - 1 - j);
    for (int i = 0; i < shares.cols; ++i) {
      const double share = row[i];
      if (!(share >= 0.0 && share <= 1.0)) {
        fail_at(relief.where, "relief.file: {}: a pixel is {}; floats must be from 0 to 1", relief.file.string(),
                share);
      }
      heights.push_back(static_cast<float>(amplitude * share));
    }
  }
  return {shares.cols,       shares.rows, 0.5 * (spacing - relief.size_mm), spacing, {relief.repeat, relief.repeat},
          std::move(heights)};
}

double finest_detail(const ImageRelief& relief) {
  const cv::Mat shares = read_shares(relief);
  return 2.0 * std::min(relief.size_mm.x() / shares.cols, relief.size_mm.y() / shares.rows);
}

}  // namespace touchstone::sim
