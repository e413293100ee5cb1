#pragma once
// Grey values and means of a picture's pixels, exact and fast: what a tracker reads of each frame.

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace touchstone::sensors {

/// Grey values of `count` pixels of blue, green and red, by OpenCV's weights, rounded as its cvtColor does.
void grey_of_bgr(const std::uint8_t* bgr, int count, std::uint8_t* grey);
/// That of one pixel of 16-bit channels.
int grey_of_bgr(const std::uint16_t* pixel);

/// The mean grey value of a part of an image, in its own digital numbers: of colour the weighted mean of the channels'
/// means. The sums are exact, so the parts' order has no say. @pre 8 or 16 bit, 1 or 3 channels; the part isn't empty
double mean_grey(const cv::Mat& image, const cv::Rect& part);

}  // namespace touchstone::sensors
