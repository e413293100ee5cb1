#pragma once

#include <atomic>
#include <memory>
#include <stdexcept>

#include "datasets/sets/sample_source.h"

namespace touchstone::test {

/// What a fake simulator was asked for.
struct FakeCalls {
  std::atomic<int> pictures{0};
  std::atomic<int> cameras{0};
  std::atomic<int> streams{0};
  int fail_at_stream = -1;   ///< in the middle of the stream of this number, likewise
  int fail_at_picture = -1;  ///< the picture of this number throws, as if the process ended there
};

/// A simulator whose truth and pictures are plain functions of scene, seed and frame number.
inline datasets::SampleSource fake_source(FakeCalls& calls) {
  datasets::SampleSource source;
  source.set_up_gel = [](const sim::DeviceSpec&, const Progress&) {
    auto gel = std::make_shared<fem::Compliance>();
    gel->vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    gel->triangles = {{0, 1, 2}, {1, 3, 2}};
    return std::shared_ptr<const fem::Compliance>(gel);
  };
  source.play_motion = [](const sim::SceneSpec& scene, const sim::Plan&, const fem::Compliance& gel, const Progress&) {
    std::vector<sim::Truth> truths;
    const auto nodes = static_cast<Eigen::Index>(gel.vertices.size());
    for (int frame = 0; frame < scene.motion.frame_count(); ++frame) {
      sim::Truth truth;
      truth.frame = frame;
      truth.t_us = 33333 * frame;
      truth.press.gel_from_object.translation = scene.motion.start_mm;
      truth.press.wrench << 0.1 * frame, -0.2 * frame, 0.5 * frame, 1, 2, 3;
      truth.press.traction = Eigen::MatrixX3d::Constant(nodes, 3, 0.25 * frame);
      truth.press.surface_displacement = Eigen::MatrixX3d::Constant(nodes, 3, 0.5 * frame);
      truth.press.bead_displacement = Eigen::MatrixX3d::Constant(4, 3, 0.125 * frame);
      truth.press.node_state = {fem::NodeState::open, fem::NodeState::stick, fem::NodeState::slip,
                                fem::NodeState::open};
      truth.press.largest_strain = 0.01 * frame;
      truth.press.lookup_error = 1e-7 * frame;
      truth.error = {{0.001 * frame, 0.002 * frame, 0.003 * frame}, 0.004 * frame, 0.005 * frame, 0.006 * frame};
      truths.push_back(std::move(truth));
    }
    return truths;
  };
  source.set_up_camera = [&calls](const sim::SceneSpec& scene, const sim::Plan&, std::shared_ptr<const fem::Compliance>,
                                  std::span<const sim::Truth>) {
    ++calls.cameras;
    const std::uint64_t seed = scene.seed;
    const auto offset = static_cast<std::size_t>(100.0 * (scene.motion.start_mm.x() + 1.0));
    const sim::CameraSpec camera = *scene.device.camera;
    return [&calls, seed, offset, camera](const sim::Truth& truth) {
      if (calls.pictures++ == calls.fail_at_picture) throw std::runtime_error("the process ends here");
      sim::Capture capture;
      capture.frame = cv::Mat(camera.height, camera.width, CV_8UC3);
      for (std::size_t i = 0; i < capture.frame.total() * 3; ++i) {
        capture.frame.data[i] =
            static_cast<unsigned char>(i * (seed + 3) + 31 * static_cast<std::size_t>(truth.frame) + offset);
      }
      capture.frame.convertTo(capture.radiance, CV_32F);
      capture.ideal = capture.frame;
      capture.pixels_traced = 10 + truth.frame;
      capture.paths_traced = 100;
      return capture;
    };
  };
  source.watch_events = [&calls](const sim::SceneSpec& scene, const sim::Plan&, const fem::Compliance&,
                                 std::uint64_t noise_seed, const sim::EventSink& sink, const Progress&) {
    const bool fails = calls.streams++ == calls.fail_at_stream;
    sim::EventStreamReport report;
    for (int portion = 0; portion < 5; ++portion) {
      std::vector<Event> events;
      for (int i = 0; i < 100; ++i) {
        const auto x = static_cast<std::uint16_t>((noise_seed + i) % scene.device.camera->width);
        events.push_back({1000 * portion + i, x, static_cast<std::uint16_t>(portion), i % 3 == 0});
      }
      if (fails && portion == 3) throw std::runtime_error("the process ends here");
      report.events += 100;
      report.paths_traced += 7;
      sink(events);
    }
    return report;
  };
  return source;
}

}  // namespace touchstone::test
