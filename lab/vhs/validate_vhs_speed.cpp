// How fast the vhs sensor's frames are worked on [VisioHaptic2024, sec. 4.2], beside OpenCV's SimpleBlobDetector on the
// same frames in the same run. Rates are per second of a core's own work, the fastest of twenty parts, so that what
// else the machine does counts little; frames are in memory, of colour, as the camera gives them.

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/random.h"
#include "core/seconds_since.h"
#include "core/whole_file.h"
#include "datasets/sets/generate.h"
#include "datasets/sets/sample_source.h"
#include "datasets/sources/frame_sequence.h"
#include "lab/validation/row_list.h"
#include "sensors/beads/bead_overlay.h"
#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/stiffness_force_model.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

constexpr double kPublishedTracking_fps = 719.0;     // sec. 4.2.1, one core
constexpr double kPublishedManyCores_fps = 1565.0;   // sec. 4.2.1
constexpr double kPublishedWithForce_fps = 1499.0;   // sec. 4.2.2, many cores
constexpr double kPublishedWithDisplay_fps = 939.0;  // sec. 4.2.2, many cores
constexpr double kNeededForce_Hz = 500.0;            // sec. 2.3.1
constexpr double kWanted_fps = 15000.0;              // ours: 25 times the camera
constexpr double kWantedRatio = 20.0;                // ours, over SimpleBlobDetector
constexpr double kCameraInterval_us = 1e6 / 601.25;  // sec. 3.1
constexpr std::int64_t kInterval_us = 1663;

/// Colour frames of one sequence, to be tracked one after the other.
struct Clip {
  sensors::BeadTrackerSettings settings;
  double bead_radius_px = 0.0;
  std::vector<cv::Mat> frames;
};

/// The verification of sec. 4.4 as the simulator sees it: beads at rest, pressed and sheared.
Clip rendered_clip(const ValidateOptions& options) {
  const std::filesystem::path job = options.scratch / "vhs-speed.yaml";
  const std::filesystem::path scene = std::filesystem::absolute(options.scenes / "vhs" / "verification.yaml");
  write_whole_file(job, fmt::format("name: vhs-speed\nseed: 1\nscenes:\n  - {{name: verification, scene: '{}', split: "
                                    "validate}}\n",
                                    scene.string()));
  datasets::GenerateOptions how = datasets::simulated(options.cache);
  const std::filesystem::path data = options.scratch / "vhs-speed";
  datasets::generate(job, data, how, options.progress);
  Clip clip;
  clip.bead_radius_px = 9.0;
  const std::vector<datasets::FrameSequence> sequences = datasets::frames_of_data_set(data, datasets::Split::validate);
  for (const datasets::LabelledFrame& frame : sequences.front().frames) {
    cv::Mat image = sim::read_image(frame.file);
    if (image.channels() == 1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
    clip.frames.push_back(image);
  }
  return clip;
}

/// A grid of dark discs that sways by a few px on a noisy ground: 10 x 10 beads in the picture of the camera.
Clip drawn_clip(int grid) {
  constexpr int kFrames = 32;
  constexpr double kSpacing_px = 43.0;
  constexpr int kShift = 6;  // fractional bits of OpenCV's drawing coordinates
  Clip clip;
  clip.settings.grid = grid;
  clip.settings.roi_a_px = static_cast<int>(kSpacing_px) * grid;
  clip.settings.roi_b_px = 20;
  clip.bead_radius_px = 5.0;
  RandomStream random(1, 0, Purpose::kTest);
  for (int frame = 0; frame < kFrames; ++frame) {
    cv::Mat image(480, 640, CV_8UC3, cv::Scalar::all(170));
    const double phase = 2.0 * std::numbers::pi * frame / kFrames;
    const Eigen::Vector2d first = Eigen::Vector2d(320.0 + 3.0 * std::sin(phase), 240.0 + 3.0 * std::cos(phase)) -
                                  Eigen::Vector2d::Constant(0.5 * kSpacing_px * (grid - 1) + 0.5);
    for (int i = 0; i < grid * grid; ++i) {
      const Eigen::Vector2d at = (first + kSpacing_px * Eigen::Vector2d(i % grid, i / grid)) * (1 << kShift);
      cv::circle(image, {static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))},
                 static_cast<int>(clip.bead_radius_px * (1 << kShift)), cv::Scalar::all(40), cv::FILLED, cv::LINE_AA,
                 kShift);
    }
    for (auto& pixel : cv::Mat_<cv::Vec3b>(image)) {
      for (int channel = 0; channel < 3; ++channel) {
        pixel[channel] = cv::saturate_cast<std::uint8_t>(pixel[channel] + 2.0 * random.normal());
      }
    }
    clip.frames.push_back(image);
  }
  return clip;
}

/// Of any stiffness: what a force costs doesn't depend on it.
sensors::StiffnessForceModel some_model(int grid) {
  const auto beads = static_cast<std::size_t>(grid * grid);
  sensors::StiffnessForceModel model;
  model.grid = grid;
  model.rest.assign(beads, Eigen::Vector2d::Zero());
  model.lowest_seen.assign(beads, Eigen::Vector3d::Constant(-1e9));
  model.highest_seen.assign(beads, Eigen::Vector3d::Constant(1e9));
  model.stiffness.assign(static_cast<std::size_t>((grid - 1) * (grid - 1)), 1e-3 * Eigen::Matrix3d::Identity());
  return model;
}

enum class Work { track, track_and_force, track_force_and_display };

struct Pace {
  double frames = 0.0;
  double seconds = 0.0;  ///< of this thread's work
  double fps() const { return frames / seconds; }
};

/// Follows the clip from its first frame on, `rounds` times. A frame's time goes to `frame_us` if it's given.
Pace follow(const Clip& clip, Work work, int rounds, std::vector<double>* frame_us = nullptr) {
  sensors::BeadTracker tracker(clip.settings);
  const sensors::StiffnessForceModel model = some_model(clip.settings.grid);
  cv::Mat picture;
  double sum = 0.0;
  std::int64_t t_us = 0;
  const double begun = thread_seconds();
  for (int round = 0; round < rounds; ++round) {
    tracker.restart();
    for (const cv::Mat& frame : clip.frames) {
      const double before = frame_us ? thread_seconds() : 0.0;
      const sensors::TrackedBeads& beads = tracker.track({frame, t_us += kInterval_us});
      if (work != Work::track) {
        const sensors::ForceEstimate force = sensors::estimate(model, beads);
        sum += force.force.z();
        if (work == Work::track_force_and_display) sensors::draw_overlay(frame, beads, force, picture);
      }
      if (frame_us) frame_us->push_back(1e6 * (thread_seconds() - before));
    }
  }
  const double seconds = thread_seconds() - begun;
  TS_ASSERT(std::isfinite(sum));
  return {rounds * static_cast<double>(clip.frames.size()), seconds};
}

/// The fastest of some parts of each work, which take turns: other programs that share a core's units with this one
/// slow it down, too, for a while.
std::vector<double> fastest_fps(const std::vector<std::function<Pace()>>& works) {
  constexpr int kParts = 20;
  std::vector<double> fps(works.size());
  for (int part = 0; part < kParts; ++part) {
    for (std::size_t i = 0; i < works.size(); ++i) fps[i] = std::max(fps[i], works[i]().fps());
  }
  return fps;
}

/// As many streams as there are cores, each on one of them: the sum of their rates.
double all_cores_fps(const Clip& clip, Work work, int rounds) {
  const int cores = tbb::info::default_concurrency();
  std::vector<double> fps(static_cast<std::size_t>(cores));
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, fps.size(), 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) fps[i] = follow(clip, work, rounds).fps();
      },
      tbb::static_partitioner());
  double sum = 0.0;
  for (const double one : fps) sum += one;
  return sum;
}

/// OpenCV's detector on the same frames, on one thread.
Pace detect_blobs(const Clip& clip, std::size_t most_frames) {
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  cv::SimpleBlobDetector::Params params;
  const auto area = static_cast<float>(std::numbers::pi * clip.bead_radius_px * clip.bead_radius_px);
  params.minArea = 0.5f * area;
  params.maxArea = 2.0f * area;
  const auto detector = cv::SimpleBlobDetector::create(params);
  std::vector<cv::KeyPoint> found;
  const std::size_t count = std::min(most_frames, clip.frames.size());
  const double begun = thread_seconds();
  for (std::size_t i = 0; i < count; ++i) detector->detect(clip.frames[i], found);
  const double seconds = thread_seconds() - begun;
  cv::setNumThreads(threads);
  return {static_cast<double>(count), seconds};
}

}  // namespace

std::vector<ValidationRow> validate_vhs_speed(const ValidateOptions& options) {
  RowList rows("vhs.speed.", options, RowList::Since::last_row);
  const Clip three = rendered_clip(options);
  const int rounds = (options.quick ? 20000 : 50000) / static_cast<int>(three.frames.size()) + 1;
  follow(three, Work::track, 1);  // the processor gets up to speed
  const auto add = [&](const char* id, const char* title, double published, double ours) {
    rows.add_bounded(id, title, "1/s", Better::higher, published, true, ours);
  };
  const auto following = [rounds](const Clip& clip, Work work) {
    return [&clip, work, rounds] { return follow(clip, work, rounds / 20 + 1); };
  };
  const std::vector<double> fps = fastest_fps({following(three, Work::track), following(three, Work::track_and_force),
                                               following(three, Work::track_force_and_display)});
  add("tracking_fps", "frames a second of the tracker on one core, 3x3 beads in colour", kPublishedTracking_fps,
      fps[0]);
  rows.add_bounded("tracking_wanted_fps", "the same, held against what this program wants", "1/s", Better::higher,
                   kWanted_fps, false, fps[0]);
  add("with_force_fps", "with forces, on one core; the paper needed many", kPublishedWithForce_fps, fps[1]);
  rows.add_bounded("force_Hz", "forces a second on one core; palpation needs 500", "Hz", Better::higher,
                   kNeededForce_Hz, true, fps[1]);
  add("with_display_fps", "with forces and both drawn into a picture for a window, on one core",
      kPublishedWithDisplay_fps, fps[2]);
  add("many_cores_fps", "frames a second on all cores, a stream on each", kPublishedManyCores_fps,
      all_cores_fps(three, Work::track, rounds));

  const auto ratio = [&](const Clip& clip, const char* id, const char* title) {
    const std::vector<double> both =
        fastest_fps({[&] { return detect_blobs(clip, options.quick ? 1 : 4); }, following(clip, Work::track)});
    rows.add_bounded(id, title, "1", Better::higher, kWantedRatio, false, both[1] / both[0]);
  };
  ratio(three, "blob_ratio_3x3", "times as fast as OpenCV's SimpleBlobDetector on the same frames, one core");
  const Clip ten = drawn_clip(10);
  ratio(ten, "blob_ratio_10x10", "the same for 10x10 drawn beads");

  std::vector<double> frame_us;
  follow(three, Work::track_and_force, rounds, &frame_us);
  std::sort(frame_us.begin(), frame_us.end());
  const auto part = [&](double fraction) {
    return frame_us[static_cast<std::size_t>(fraction * static_cast<double>(frame_us.size() - 1))];
  };
  const auto add_latency = [&](const char* id, const char* title, double ours) {
    rows.add_bounded(id, title, "us", Better::lower, kCameraInterval_us, false, ours);
  };
  add_latency("latency_p50_us", "from a frame to its force, median, beside the camera's interval", part(0.5));
  add_latency("latency_p99_us", "from a frame to its force, 99 % of frames", part(0.99));
  add_latency("latency_max_us", "from a frame to its force, the slowest frame", part(1.0));
  return rows.rows();
}

}  // namespace touchstone::lab
