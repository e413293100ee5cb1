#include "render/paths/trace_twice.h"

#include "render/paths/path_tracer.h"
#include "render/sampling/sample_sequence.h"

namespace touchstone::render {

std::array<cv::Mat, 2> trace_twice(const Scene& scene, const Camera& camera, const cv::Mat& mask, int samples,
                                   int max_depth, std::uint64_t seed) {
  const Tracer tracer(scene);
  RenderSettings paths;
  paths.min_samples = paths.max_samples = samples;
  paths.max_depth = max_depth;
  std::array<cv::Mat, 2> traced;
  for (std::size_t k = 0; k < 2; ++k) {
    paths.seed = mix_bits(2 * seed + k);
    traced[k] = tracer.render(camera, paths, mask).irradiance;
  }
  return traced;
}

}  // namespace touchstone::render
