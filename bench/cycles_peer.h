#pragma once
// Blender's Cycles beside us: hands a scene of ours to bench/cycles_scene.py, which draws it.

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "render/cameras/pinhole_camera.h"
#include "render/scene/scene.h"

namespace touchstone::bench {

struct CyclesOptions {
  int threads = 1;
  int most_bounces = 128;        ///< of all kinds on a path; 0: light that comes straight from a lamp to what is seen
  int most_matt_bounces = 128;   ///< 1: light that comes from a lamp through smooth faces only, or straight
  bool shadow_caustics = false;  ///< Cycles' own connections through smooth faces (manifold next event estimation)
};

/// A picture that is wanted.
struct CyclesJob {
  std::uint32_t seed = 0;  ///< below 2^31
  int samples = 1;         ///< a pixel
};

struct CyclesPicture {
  cv::Mat radiance;                ///< CV_32FC3 (R, G, B), W/m^2/sr at the hole
  double seconds = 0.0;            ///< of tracing: without start-up and what a picture of one sample takes
  double processor_seconds = 0.0;  ///< likewise, summed over the threads
};

struct CyclesRun {
  std::string version;
  double overhead_seconds = 0.0;  ///< of a picture of one sample: the scene made ready, the tree built
  std::vector<CyclesPicture> pictures;
};

/// Why Cycles can't be run here, or the empty string.
std::string why_no_cycles();

/// Draws the scene in a process of its own; `scratch` is a folder for the files that are exchanged. What both programs
/// mean alike: flat faces between clear media, Lambertian meshes, SpotLamps with a lens and no soft rim, three bands
/// that stand for R, G and B, dark surroundings, and the pinhole camera with a point for its hole.
/// @throws Error for a scene of other things, or if Cycles fails, with what it said
CyclesRun run_cycles(const render::Scene& scene, const render::PinholeCamera& camera, const CyclesOptions& options,
                     const std::vector<CyclesJob>& jobs, const std::filesystem::path& scratch);

}  // namespace touchstone::bench
