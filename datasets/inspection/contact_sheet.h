#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace touchstone::datasets {

/// One picture with all of `images` in rows of `columns`, each scaled to `tile_width_px` with its caption below in
/// black on white: CV_8UC3, BGR. Images are 8 or 16 bit (shown by their upper 8 bits), grey or BGR, of any sizes; they
/// keep their proportions. A caption is plain ASCII; it breaks at '\n' and between words where it's wider than its
/// tile, and a word that is wider alone is shrunk.
/// @throws Error if there is no image, an image is empty or of another type, there aren't as many captions as images,
/// or columns < 1 or tile_width_px < 32
cv::Mat contact_sheet(const std::vector<cv::Mat>& images, const std::vector<std::string>& captions, int columns,
                      int tile_width_px);

}  // namespace touchstone::datasets
