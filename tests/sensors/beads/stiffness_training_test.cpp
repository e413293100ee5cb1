#include "sensors/beads/stiffness_training.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "core/error.h"
#include "tests/sensors/beads/force_samples.h"

namespace touchstone::sensors {
namespace {

using fixtures::known_model;
using fixtures::load_cycle_samples;
using fixtures::samples_of;

double largest_difference(const StiffnessForceModel& a, const StiffnessForceModel& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.stiffness.size(); ++i) {
    largest = std::max(largest, (a.stiffness[i] - b.stiffness[i]).cwiseAbs().maxCoeff());
  }
  return largest;
}

/// The rule of [VisioHaptic2024], for samples whose loss may never drop so far.
TrainingSettings published_up_to(std::int64_t max_iterations) {
  TrainingSettings settings = TrainingSettings::as_published();
  settings.max_iterations = max_iterations;
  return settings;
}

/// The mean squared error of a model on samples, per axis.
Eigen::Vector3d loss_of(const StiffnessForceModel& model, const ForceSamples& samples) {
  Eigen::Vector3d loss = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < samples.forces.size(); ++i) {
    loss += (estimate_force(model, samples.positions[i], samples.rest) - samples.forces[i]).cwiseAbs2();
  }
  return loss / static_cast<double>(samples.forces.size());
}

TEST(StiffnessTraining, KnownCoefficientsAreRecovered) {
  for (const MatrixForm form : {MatrixForm::kAsymmetric, MatrixForm::kSymmetric, MatrixForm::kDiagonal}) {
    for (const bool momentum : {false, true}) {
      const StiffnessForceModel truth = known_model(3, form, 21);
      TrainingSettings settings = TrainingSettings::to_convergence();
      settings.form = form;
      settings.momentum = momentum;
      const TrainedModel trained = train(samples_of(truth, 400), settings);
      EXPECT_EQ(trained.report.end, TrainingEnd::kConverged);
      EXPECT_LT(largest_difference(trained.model, truth), 1e-9) << name_of(form) << (momentum ? ", momentum" : "");
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(trained.report.r2[axis], 1.0, 1e-9);
    }
  }
}

TEST(StiffnessTraining, LargerGridsTrainToo) {
  const StiffnessForceModel truth = known_model(6, MatrixForm::kAsymmetric, 22);
  const TrainedModel trained = train(samples_of(truth, 1500), TrainingSettings::to_convergence());
  EXPECT_LT(largest_difference(trained.model, truth), 1e-8);
}

TEST(StiffnessTraining, PublishedRuleStopsAtAHundredthOfTheLoss) {
  ForceSamples samples = load_cycle_samples(400, 0.05);  // correlated motions, but forces that a model can reach
  const StiffnessForceModel truth = known_model(3, MatrixForm::kAsymmetric, 23);
  for (std::size_t i = 0; i < 400; ++i) {
    samples.forces[i] = estimate_force(truth, samples.positions[i], samples.rest);
  }
  const TrainedModel trained = train(samples, TrainingSettings::as_published());
  EXPECT_EQ(trained.report.end, TrainingEnd::kLossDropped);
  ASSERT_GT(trained.report.iterations, 1);
  EXPECT_EQ(trained.model.training.stop, StopRule::kLossDrop);
  EXPECT_LE(trained.report.final_loss.sum(), 0.01 * trained.report.first_loss.sum() * (1 + 1e-12));
  // One iteration fewer isn't enough: it stops at the first that is.
  TrainingSettings shorter = TrainingSettings::as_published();
  shorter.max_iterations = trained.report.iterations - 1;
  const TrainedModel before = train(samples, shorter);
  EXPECT_EQ(before.report.end, TrainingEnd::kOutOfIterations);
  EXPECT_GT(before.report.final_loss.sum(), 0.01 * before.report.first_loss.sum());
}

TEST(StiffnessTraining, FirstLossIsTheMeanSquareForce) {
  const ForceSamples samples = samples_of(known_model(3, MatrixForm::kAsymmetric, 24), 100);
  Eigen::Vector3d square = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& force : samples.forces) square += force.cwiseAbs2() / 100.0;
  const TrainingReport report = train(samples, TrainingSettings::as_published()).report;
  EXPECT_LT((report.first_loss - square).norm(), 1e-12 * square.norm());
  EXPECT_EQ(report.history.front().iteration, 0);
  EXPECT_LT((report.history.front().loss - square).norm(), 1e-12 * square.norm());
}

TEST(StiffnessTraining, LossNeverRisesInPlainDescent) {
  TrainingSettings settings = TrainingSettings::to_convergence();
  settings.momentum = false;
  settings.max_iterations = 20'000;
  const TrainingReport report = train(load_cycle_samples(1000, 0.05), settings).report;
  ASSERT_GT(report.history.size(), 5u);
  for (std::size_t i = 1; i < report.history.size(); ++i) {
    EXPECT_LE(report.history[i].loss.sum(), report.history[i - 1].loss.sum() * (1 + 1e-9)) << i;
    EXPECT_GT(report.history[i].iteration, report.history[i - 1].iteration);
  }
  EXPECT_EQ(report.history.back().iteration, report.iterations);
}

TEST(StiffnessTraining, ConvergedModelIsTheLeastSquaresOne) {
  // Correlated features and noise, as the load cycle gives: z has twelve coefficients; solve for them directly.
  const ForceSamples samples = load_cycle_samples(2000, 0.05);
  const TrainedModel trained = train(samples, TrainingSettings::to_convergence());
  EXPECT_EQ(trained.report.end, TrainingEnd::kConverged);
  Eigen::MatrixXd features(2000, 12);
  Eigen::VectorXd forces(2000);
  StiffnessForceModel probe = trained.model;
  for (Eigen::Index k = 0; k < 12; ++k) {  // the features by the model's own eyes: one coefficient at a time
    for (auto& h : probe.stiffness) h.setZero();
    probe.stiffness[static_cast<std::size_t>(k / 3)](2, k % 3) = 1.0;
    for (std::size_t i = 0; i < 2000; ++i) {
      features(static_cast<Eigen::Index>(i), k) = estimate_force(probe, samples.positions[i], samples.rest).z();
      forces[static_cast<Eigen::Index>(i)] = samples.forces[i].z();
    }
  }
  const Eigen::VectorXd best = (features.transpose() * features).ldlt().solve(features.transpose() * forces);
  const double least = (features * best - forces).squaredNorm() / 2000.0;
  EXPECT_LT(trained.report.final_loss.z(), least * (1 + 1e-5));
  EXPECT_GE(trained.report.final_loss.z(), least * (1 - 1e-9));
}

TEST(StiffnessTraining, ConvergenceIsNoWorseThanThePublishedRule) {
  const ForceSamples samples = load_cycle_samples(2000, 0.05);
  const TrainingReport published = train(samples, published_up_to(20'000)).report;
  const TrainingReport converged = train(samples, TrainingSettings::to_convergence()).report;
  EXPECT_LE(converged.final_loss.sum(), published.final_loss.sum());
}

TEST(StiffnessTraining, AsymmetricFormBeatsTheOthersWhereAxesCouple) {
  const ForceSamples samples = samples_of(known_model(3, MatrixForm::kAsymmetric, 25), 500, 0.02);
  const auto z_loss = [&](MatrixForm form) {
    TrainingSettings settings = TrainingSettings::to_convergence();
    settings.form = form;
    return train(samples, settings).report.final_loss.z();
  };
  const double asymmetric = z_loss(MatrixForm::kAsymmetric);
  EXPECT_LT(asymmetric, 1.1 * 0.02 * 0.02);
  EXPECT_GT(z_loss(MatrixForm::kDiagonal), 10.0 * asymmetric);
  EXPECT_GT(z_loss(MatrixForm::kSymmetric), 2.0 * asymmetric);
}

TEST(StiffnessTraining, ReportIsWhatTheModelDoes) {
  const ForceSamples samples = load_cycle_samples(500, 0.05);
  for (const TrainingSettings& settings : {published_up_to(20'000), TrainingSettings::to_convergence()}) {
    const TrainedModel trained = train(samples, settings);
    const Eigen::Vector3d loss = loss_of(trained.model, samples);
    EXPECT_LT((trained.report.final_loss - loss).norm(), 1e-12);
    EXPECT_LT((trained.model.training.rms_error_N - loss.cwiseSqrt()).norm(), 1e-12);
    EXPECT_LT((trained.report.history.back().loss - loss).norm(), 1e-9);
    EXPECT_EQ(trained.model.training.samples, 500);
    EXPECT_EQ(fault_of(trained.model), "");
    for (const auto& positions : samples.positions) {
      EXPECT_FALSE(is_extrapolated(trained.model, positions, samples.rest));
    }
  }
}

TEST(StiffnessTraining, UnitsOfThePositionsHaveNoSay) {
  // Diagonal scaling makes the descent the same whatever unit x and y have.
  ForceSamples samples = load_cycle_samples(500, 0.05);
  const TrainingReport px = train(samples, published_up_to(5'000)).report;
  for (auto& position : samples.rest) position *= 1e-3;
  for (auto& positions : samples.positions) {
    for (auto& position : positions) position *= 1e-3;
  }
  const TrainingReport kilo_px = train(samples, published_up_to(5'000)).report;
  EXPECT_EQ(px.iterations, kilo_px.iterations);
  EXPECT_LT((px.final_loss - kilo_px.final_loss).norm(), 1e-9);
}

TEST(StiffnessTraining, LossThatCannotDropEndsAnyway) {
  ForceSamples samples = samples_of(known_model(3, MatrixForm::kAsymmetric, 26), 200);
  RandomStream random(3, 0, Purpose::kTest);
  for (auto& force : samples.forces) force = {random.normal(), random.normal(), random.normal()};
  const TrainedModel trained = train(samples, TrainingSettings::as_published());
  EXPECT_EQ(trained.report.end, TrainingEnd::kConverged);
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(trained.report.r2[axis], 0.2);
}

TEST(StiffnessTraining, AxisWithoutForceStaysAtZero) {
  ForceSamples samples = load_cycle_samples(300, 0.0);
  for (auto& force : samples.forces) force.x() = 0.0;
  const TrainedModel trained = train(samples, TrainingSettings::to_convergence());
  for (const auto& h : trained.model.stiffness) EXPECT_EQ(h(0, 0), 0.0);
  EXPECT_EQ(trained.report.r2.x(), 0.0);
  EXPECT_GT(trained.report.r2.y(), 0.5);
}

TEST(StiffnessTraining, OneRunIsTheOtherBitForBit) {
  const ForceSamples samples = load_cycle_samples(700, 0.05);
  const TrainedModel one = train(samples, TrainingSettings::to_convergence());
  const TrainedModel other = train(samples, TrainingSettings::to_convergence());
  EXPECT_EQ(largest_difference(one.model, other.model), 0.0);
  EXPECT_EQ(one.report.iterations, other.report.iterations);
}

TEST(StiffnessTraining, BadSamplesAreRefusedByName) {
  const ForceSamples good = samples_of(known_model(3, MatrixForm::kAsymmetric, 27), 20);
  const auto refused = [&](auto change) -> std::string {
    ForceSamples samples = good;
    TrainingSettings settings;
    change(samples, settings);
    try {
      train(samples, settings);
    } catch (const Error& error) {
      return error.what();
    }
    return "(no error)";
  };
  using testing::HasSubstr;
  EXPECT_THAT(refused([](auto& s, auto&) { s.grid = 4; }), HasSubstr("9 rest positions"));
  EXPECT_THAT(refused([](auto& s, auto&) { s.grid = 0; }), HasSubstr("grid is 0"));
  EXPECT_THAT(refused([](auto& s, auto&) { s.positions.clear(), s.forces.clear(); }), HasSubstr("no samples"));
  EXPECT_THAT(refused([](auto& s, auto&) { s.forces.pop_back(); }), HasSubstr("20 lists of positions but 19"));
  EXPECT_THAT(refused([](auto& s, auto&) { s.positions[7].pop_back(); }), HasSubstr("sample 7 has 8"));
  EXPECT_THAT(refused([](auto& s, auto&) { s.positions[7][2].x() = std::nan(""); }), HasSubstr("sample 7"));
  EXPECT_THAT(refused([](auto& s, auto&) { s.forces[5].z() = INFINITY; }), HasSubstr("force of sample 5"));
  EXPECT_THAT(refused([](auto& s, auto&) { s.rest[0].x() = std::nan(""); }), HasSubstr("rest position"));
  EXPECT_THAT(refused([](auto& s, auto&) {
                for (auto& force : s.forces) force.setZero();
              }),
              HasSubstr("force is 0 in all 20"));
  EXPECT_THAT(refused([](auto& s, auto&) {
                for (auto& positions : s.positions) positions = s.rest;
              }),
              HasSubstr("no bead moves"));
  EXPECT_THAT(refused([](auto&, auto& t) { t.loss_drop = 1.0; }), HasSubstr("loss_drop is 1"));
  EXPECT_THAT(refused([](auto&, auto& t) { t.least_improvement = 0.0; }), HasSubstr("least_improvement is 0"));
  EXPECT_THAT(refused([](auto&, auto& t) { t.max_iterations = 0; }), HasSubstr("max_iterations is 0"));
}

}  // namespace
}  // namespace touchstone::sensors
