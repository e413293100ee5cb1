// Tracks nine drawn beads, trains a force model on them moving, and reads the force of one more frame.

#include <core/error.h>

#include <sensors/beads/bead_tracker.h>
#include <sensors/beads/stiffness_force_model.h>
#include <sensors/beads/stiffness_model_file.h>
#include <sensors/beads/stiffness_training.h>
#include <cstdio>
#include <opencv2/imgproc.hpp>

using namespace touchstone;
using namespace touchstone::sensors;

namespace {

/// Nine beads, `spread` px apart, moved sideways by `shift` px.
cv::Mat draw(double spread, double shift) {
  cv::Mat image(480, 640, CV_8U, cv::Scalar(170));
  for (int i = 0; i < 9; ++i) {
    const double x = 320.0 + spread * (i % 3 - 1) + shift;
    const double y = 240.0 + spread * (i / 3 - 1);
    cv::circle(image, cv::Point(static_cast<int>(x * 64), static_cast<int>(y * 64)), 9 * 64, cv::Scalar(40), cv::FILLED,
               cv::LINE_AA, 6);
  }
  return image;
}

}  // namespace

int main() {
  try {
    BeadTracker tracker({});
    ForceSamples samples;
    samples.rest = tracker.track({draw(70.0, 0.0), 0}).positions;
    std::int64_t t_us = 0;
    for (int i = 0; i < 100; ++i) {
      const double normal = 0.05 * i;
      const double shear = i % 10 < 5 ? 0.3 * (i % 10) : 0.3 * (10 - i % 10);
      samples.positions.push_back(tracker.track({draw(70.0 + normal, 4.0 * shear), t_us += 33'333}).positions);
      samples.forces.push_back({shear, 0.0, normal});
    }
    const TrainedModel trained = train(samples, TrainingSettings::to_convergence());
    const StiffnessForceModel model = stiffness_model_from_json(to_json(trained.model), "model");
    const ForceEstimate force = estimate(model, tracker.track({draw(72.5, 3.0), t_us += 33'333}));
    std::printf("force %.2f %.2f %.2f N, true 0.75 0.00 2.50 N\n", force.force.x(), force.force.y(), force.force.z());
    const Eigen::Vector3d error = force.force - Eigen::Vector3d(0.75, 0.0, 2.5);
    return error.cwiseAbs().maxCoeff() < 0.2 && force.beads_missing == 0 ? 0 : 1;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
