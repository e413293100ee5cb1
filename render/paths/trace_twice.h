#pragma once
// Two path traced pictures of the same pixels, independent of each other: where a third picture differs from both, the
// product of the differences is free of the paths' noise on the mean.

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "render/cameras/camera.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// W/m^2 at the pixels that `mask` (CV_8UC1) has, each of so many paths. @throws Error as Tracer
std::array<cv::Mat, 2> trace_twice(const Scene& scene, const Camera& camera, const cv::Mat& mask, int samples,
                                   int max_depth, std::uint64_t seed);

}  // namespace touchstone::render
