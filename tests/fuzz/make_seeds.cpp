// Writes the seeds of the targets `models`, `events`, `event_hdf5`, `set_up_results`, `blocks` and `pictures` by the
// project's own writers: `fuzz_make_seeds tests/fuzz/corpus`, after a format has changed. As small as they can be,
// since that is how they're mutated best.

#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "core/matrix_file.h"
#include "core/random.h"
#include "core/whole_file.h"
#include "datasets/sets/block_file.h"
#include "datasets/sets/truth_file.h"
#include "fem/elements/compliance_file.h"
#include "lab/fit/fit_so_far.h"
#include "sensors/beads/stiffness_model_file.h"
#include "sensors/colour/hue_model_file.h"
#include "sensors/events/event_file.h"
#include "sensors/events/grasp_force_model_file.h"
#include "sensors/events/material_classifier_file.h"
#include "sensors/events/time_delay_network_file.h"
#include "sensors/heights/darkness_model_file.h"
#include "sensors/heights/height_model_file.h"
#include "sensors/learning/gaussian_process_file.h"
#include "sensors/markers/gel_force_model.h"
#include "sensors/reflex/explore_model.h"
#include "sensors/reflex/reflex_model.h"
#include "sensors/skin/colour_model.h"
#include "sensors/skin/softness_model.h"
#include "sensors/texture/texture_model_file.h"
#include "sensors/touch_map/tactile_map_file.h"
#include "sensors/tractions/marker_compliance_file.h"
#include "sim/files/image_file.h"
#include "sim/press/press_path_file.h"
#include "sim/sensor/light_file.h"
#include "sim/sensor/traced_slab.h"
#include "tests/support/small_light.h"

namespace touchstone::fuzz {
namespace {

using namespace touchstone::sensors;

ExploreModel explore() {
  ExploreModel model;
  model.press = {2, {16.0, 0.5, 0.0}, 0.4};
  model.force = {1.125, 0.5, 0.25};
  model.lateral_mm_per_px << 0.5, 0.0, 0.0, 0.5;
  model.shear = ShearLaw{Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Constant(0.25), 0.1};
  return model;
}

ReflexModel reflex() {
  ReflexModel model;
  model.tree.nodes.resize(3);
  model.tree.nodes[0] = {ChipFeature::maximum, 37.0, 1, 2, false};
  model.tree.nodes[1].force_present = true;
  model.force.coefficients = {-10.0, 0.5, 0.25, 0.0, 0.125};
  model.force.rms_residual_N = 0.5;
  return model;
}

GaussianProcess process() {
  const Eigen::MatrixXd inputs = (Eigen::MatrixXd(3, 2) << 0.0, 0.5, 0.25, 0.5, 0.75, 2.0).finished();
  return condition({Eigen::Vector2d(0.5, 1.5), 1.5, 0.25}, inputs, Eigen::Vector3d(1.0, 0.75, 0.5));
}

GelForceModel gel_force() {
  const LinearForce line{.newton_per_unit = 0.5,
                         .offset_N = 0.0,
                         .r2 = 0.875,
                         .rms_residual_N = 0.125,
                         .largest_residual_N = 0.25,
                         .lowest_seen = 0.0,
                         .highest_seen = 2.0,
                         .samples = 3};
  GelForceModel model;
  model.gel = "gel";
  model.mm_per_px = 0.0625;
  model.normal = {{"ball", line}};
  model.shear = line;
  return model;
}

HueModel hue(HueForm form) {
  HueModel model;
  model.form = form;
  model.spacing_mm = 3.0;
  model.parallax = {.viewing_distance_mm = 380.0, .axis_mm = {0.0, 0.0}};
  model.line = {.hue_slope = -0.25, .hue_offset = 0.0, .gain_slope = 0.125, .gain = 0.5, .of_ink = true};
  model.polynomial.features = {false, false, false, true, false, false, false};
  model.polynomial.degree = 1;
  model.polynomial.scale = Eigen::VectorXd::Constant(1, 0.5);
  model.polynomial.coefficients = Eigen::MatrixXd::Constant(hue_terms(1, 1).rows(), 3, 0.25);
  model.isotropic.features = {false, true, false, false, true, false, false};
  model.isotropic.degree = 1;
  const int scalars = IsotropicFeatures::count(model.isotropic.features);
  model.isotropic.scale = Eigen::VectorXd::Constant(scalars, 0.5);
  model.isotropic.press = Eigen::VectorXd::Constant(hue_terms(scalars, 1).rows(), 0.5);
  model.isotropic.lateral = Eigen::VectorXd::Constant(1 + count_lower_terms(scalars, 1), 0.5);
  model.gains = {{7, 1.0, 0.5}};
  model.range.lowest_hue = -0.5;
  model.range.highest_hue = 0.5;
  model.range.largest_shift_mm = 0.5;
  model.range.largest_ink_shift_mm = 1.0;
  model.range.precision.setIdentity();
  model.range.largest_distance = 17.0;
  model.samples = 315;
  model.rms_error_mm = 0.25;
  return model;
}

FeedForwardNetwork network(int inputs, int outputs) {
  RandomStream random(1, 0, Purpose::kTest);
  FeedForwardNetwork made = random_network(
      {.inputs = inputs, .hidden_layers = 1, .units = 2, .outputs = outputs, .sigmoid = Sigmoid::kLogistic}, random);
  for (auto& weights : made.weights) weights = (8.0 * weights).array().round() / 8.0;  // few digits
  for (auto& biases : made.biases) biases = (8.0 * biases).array().round() / 8.0;
  return made;
}

MaterialClassifier classifier() {
  return {{"foam", "steel"}, {Eigen::Vector2d(0.0, 0.5), Eigen::Vector2d(100.0, 3.5)}, network(2, 2)};
}

TimeDelayNetwork delays() {
  TimeDelayNetwork model;
  model.delays = 2;
  model.features = {Eigen::Vector2d(0.0, 0.5), Eigen::Vector2d(100.0, 3.5)};
  model.force_N = {Eigen::VectorXd::Constant(1, 0.0), Eigen::VectorXd::Constant(1, 3.5)};
  model.network = network(4, 1);
  return model;
}

StiffnessForceModel stiffness() {
  StiffnessForceModel model;
  model.grid = 2;
  model.form = MatrixForm::kDiagonal;
  model.stiffness = {Eigen::Matrix3d::Identity()};
  model.rest = {{0.0, 0.0}, {70.0, 0.0}, {0.0, 70.0}, {70.0, 70.0}};
  model.lowest_seen.assign(4, Eigen::Vector3d::Constant(-10.0));
  model.highest_seen.assign(4, Eigen::Vector3d::Constant(10.0));
  return model;
}

DarknessModel darkness() {
  DarknessModel model;
  model.mm_per_px = 0.05;
  model.rest = {cv::Mat(2, 3, CV_32FC1, cv::Scalar(100.0)), 3, 2, 1.5};
  model.curve = {-1, {-0.05, 0.0, 0.05, 0.12}, {0.01, 0.01, 0.01, 0.02}};
  model.presses = 1;
  return model;
}

HeightModel height() {
  HeightModel model;
  model.mm_per_px = 0.05;
  model.background = {cv::Mat(2, 3, CV_32FC3, cv::Scalar(100.0, 110.0, 120.0)), 1, cv::Vec3d(1.0, 1.0, 1.0)};
  model.lamps = {.width = 3, .height = 2, .columns = 1, .rows = 1, .nodes = {Eigen::Matrix3d::Identity()}};
  model.table.cells = {1, 1, 2};
  model.table.lowest.setConstant(-2.0F);
  model.table.step = 2.0F;
  model.table.slopes.assign(2, Eigen::Vector2f::Zero());
  model.table.hits.assign(2, 1);
  model.white_balance = true;
  RandomStream random(1, 0, Purpose::kTest);
  model.network = SlopeNetwork{
      random_network({.inputs = SlopeNetwork::kInputs, .hidden_layers = 1, .units = 1, .outputs = 2}, random)};
  model.steepest_calibrated = 0.5;
  model.presses = 1;
  return model;
}

MarkerCompliance compliance() {
  MarkerCompliance made;
  made.marker_grid = {1, 1};
  made.patch_grid = {1, 1};
  made.patch_side = 2.0;
  made.thickness = 5.0;
  made.youngs_modulus = 0.5;
  made.poisson_ratio = 0.5;
  made.gel = "gel";
  made.marker_rest = {Eigen::Vector3d::Zero()};
  made.displacement = Eigen::Matrix3d::Identity();
  return made;
}

TactileMapData map() {
  TactileMapData data;
  data.height_mm = cv::Mat(2, 2, CV_32FC1, cv::Scalar(0.5));
  data.weight = cv::Mat(2, 2, CV_32FC1, cv::Scalar(1.0));
  data.frame.mm_per_px = 0.05;
  data.touches = 1;
  return data;
}

ColourModel colour() {
  ColourModel model;
  model.field.white = cv::Mat(3, 4, CV_32FC3, cv::Scalar(100, 110, 120));
  model.field.trusted = cv::Mat(3, 4, CV_8UC1, cv::Scalar(255));
  model.field.trusted.at<std::uint8_t>(1, 1) = 0;
  model.matrix.xyz_from_rgb << 0.5, 0.25, 0.125, 0.25, 0.625, 0.125, 0.0, 0.125, 0.9375;
  model.patches = 4;
  model.mean_error_de2000 = 0.5;
  model.largest_error_de2000 = 1.0;
  return model;
}

SoftnessModel softness() {
  SoftnessModel model;
  model.rate_Hz = 250.0;
  model.highest_Hz = 60.0;
  model.networks = {classifier(), classifier()};
  return model;
}

TextureModel texture() {
  TextureModel model;
  model.op = {{4, 1.0}, 1};
  model.classes = {"a", "b"};
  model.features = TextureModel::Features::Zero(2, feature_size(model.op));
  model.features.col(0).setOnes();
  model.labels = {0, 1};
  return model;
}

/// Enough to have runs of columns, both polarities and two times.
std::vector<Event> events() {
  std::vector<Event> made;
  for (std::uint16_t x = 3; x < 17; ++x) made.push_back({1000, x, 5, true});
  made.push_back({1001, 4, 6, false});
  made.push_back({17'000'000, 30, 25, true});
  return made;
}

const std::string kKey(64, 'a');

/// A gel of one triangle and one bead.
fem::Compliance gel() {
  fem::Compliance made;
  made.thickness = 4.0;
  made.vertices = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};
  made.triangles = {{0, 1, 2}};
  made.mass.resize(3, 3);
  made.mass.setIdentity();
  made.surface = Eigen::MatrixXd(Eigen::MatrixXd::Identity(9, 9));
  made.beads = fem::SharedMatrix(Eigen::MatrixXd(Eigen::MatrixXd::Constant(3, 9, 0.25)));
  made.mesh_error.smooth.radius_per_edge = {2.0};
  made.mesh_error.smooth.errors.resize(1);
  return made;
}

/// The same with its far parts compressed: two clusters of one and two vertices, and what joins them.
fem::Compliance compressed_gel() {
  fem::FarFieldMatrix::Parts parts;
  parts.order = {1, 0, 2};
  parts.clusters = {{2, {-1, -1}, 0, 1, 1, 0}, {2, {-1, -1}, 1, 3, 1, 3}, {-1, {0, 1}, 0, 3, 0, 9}};
  parts.blocks = {{0, 0, false, 9}, {1, 1, false, 18}, {1, 0, true, 54}};
  parts.numbers = fem::SharedMatrix(Eigen::MatrixXd(Eigen::MatrixXd::Constant(55, 1, 0.5)));
  fem::Compliance made = gel();
  made.surface = fem::FarFieldMatrix(std::move(parts));
  return made;
}

/// With a picture of bounced light.
sim::FoundLight light() {
  sim::FoundLight made = test::small_light(1);
  made.choice.reason = "small";
  made.bounced = cv::Mat(1, 2, CV_32FC1, cv::Scalar(0.5));
  return made;
}

/// Of the gel above, with its first vertex in contact.
fem::PressState press() {
  fem::PressState state;
  state.wrench << 0.0, 0.0, 1.0, 0.0, 0.0, 0.0;
  state.traction = Eigen::MatrixX3d::Constant(3, 3, 0.25);
  state.surface_displacement = Eigen::MatrixX3d::Constant(3, 3, -0.5);
  state.bead_displacement = Eigen::MatrixX3d::Constant(1, 3, -0.25);
  state.node_state = {fem::NodeState::stick, fem::NodeState::open, fem::NodeState::open};
  state.node_owner = {0, -1, -1};
  state.bodies = {{state.gel_from_object, state.wrench, 0.5, 1}};
  return state;
}

/// A picture of 2 x 1 pixels and one band.
sim::TracedSlab milky_slab() {
  sim::TracedSlab slab;
  slab.rest = cv::Mat(1, 2, CV_32FC1, cv::Scalar(0.5));
  slab.shares = {std::vector<double>(std::size(sim::kFlatStates), 0.5)};
  return slab;
}

/// Two unknowns and three residuals.
lab::KeptFit fit() {
  lab::KeptFit kept;
  kept.so_far.search.x = Eigen::Vector2d(0.5, 0.25);
  kept.so_far.search.residuals = Eigen::Vector3d(1.0, 0.5, 0.25);
  kept.so_far.search.jacobian = Eigen::MatrixXd::Constant(3, 2, 0.5);
  kept.so_far.before = kept.so_far.search.residuals;
  kept.so_far.labelled = {{{0.5, -0.5}, 0.25}};
  return kept;
}

void write_set_up_results(const std::filesystem::path& corpus) {
  fem::write_compliance(corpus / "whole.compliance", kKey, gel());
  fem::write_compliance(corpus / "compressed.compliance", kKey, compressed_gel());
  sim::write_light(corpus, kKey, light());
  std::filesystem::rename(sim::light_file(corpus, kKey), corpus / "light.bin");
  sim::write_traced(corpus, kKey, milky_slab());
  std::filesystem::rename(sim::light_file(corpus, kKey), corpus / "milky-slab.bin");
  write_whole_file(corpus / "fit.bin", lab::kept_fit(fit()));
  sim::write_press_path(corpus / "press-path.bin", kKey, {.at = {0.0}, .states = {press()}, .stopped = "", .note = ""});
  // As fem/vibration/vibration_cache.cpp writes them: frequency, surface, beads, effective mass, mass.
  write_whole_file(corpus / "vibration.bin",
                   matrix_file("TSVIBRAT", kKey,
                               {Eigen::MatrixXd::Constant(1, 1, 100.0), Eigen::MatrixXd::Constant(9, 1, 0.5),
                                Eigen::MatrixXd::Constant(3, 1, 0.5), Eigen::MatrixXd::Constant(3, 1, 0.25),
                                Eigen::MatrixXd::Constant(1, 1, 1.0)}));
}

void write_truth(const std::filesystem::path& file) {
  const datasets::TruthHeader header{.job_name = "job",
                                     .version = "0",
                                     .samples = 2,
                                     .objects = 1,
                                     .scenes = {"scene"},
                                     .bead_rest = {{0.0, 0.0, -1.0}}};
  datasets::TruthFileWriter writer(file, header, gel());
  for (int frame = 0; frame < 2; ++frame) {
    sim::Truth truth;
    truth.frame = frame;
    truth.t_us = 1000 * frame;
    truth.press = press();
    writer.append(0, datasets::Split::train, truth);
  }
  writer.close();
}

/// Two samples with pictures of 3 x 2.
void write_block(const std::filesystem::path& file) {
  datasets::PreparedDraw prepared;
  prepared.job.name = "job";
  prepared.job.outputs = {};
  prepared.job.outputs.frame = prepared.job.outputs.height = prepared.job.outputs.contact = true;
  datasets::UnitSensor sensor;
  sensor.light = "direct";
  sensor.background = cv::Mat(2, 3, CV_8UC1, cv::Scalar(100));
  std::vector<datasets::BlockRecord> records(2);
  for (datasets::BlockRecord& record : records) {
    record.frame = sensor.background;
    record.height = cv::Mat(2, 3, CV_32FC1, cv::Scalar(0.5));
    record.contact = cv::Mat(2, 3, CV_8UC1, cv::Scalar(255));
  }
  const datasets::DrawnBlock block{.number = 0, .unit = 0, .first_sample = 0, .samples = 2};
  const std::filesystem::path out = file.parent_path();
  std::filesystem::create_directories((out / datasets::block_name(block)).parent_path());
  datasets::DrawnUnit unit;
  unit.text = "name: unit\n";
  datasets::write_block(out, "run", prepared, block, unit, sensor, records);
  std::filesystem::rename(out / datasets::block_name(block), file);
  std::filesystem::remove((out / datasets::block_name(block)).parent_path());
}

void write_pictures(const std::filesystem::path& corpus) {
  const cv::Mat grey = (cv::Mat_<std::uint8_t>(2, 3) << 0, 50, 100, 150, 200, 255);
  cv::Mat coloured;
  cv::merge(std::vector<cv::Mat>{grey, grey, grey}, coloured);
  cv::Mat floats;
  coloured.convertTo(floats, CV_32F);
  sim::write_png(corpus / "grey.png", grey);
  sim::write_png(corpus / "coloured.png", coloured, {{"touchstone", "a"}});
  sim::write_exr(corpus / "floats.exr", floats, {"B", "G", "R"});
  for (const char* ending : {".jpg", ".tif", ".bmp"}) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(ending, coloured, bytes);
    write_whole_file(corpus / (std::string("coloured") + ending), std::string(bytes.begin(), bytes.end()));
  }
}

void write_seeds(const std::filesystem::path& corpus) {
  for (const char* folder : {"models", "events", "event_hdf5", "set_up_results", "blocks", "pictures"}) {
    std::filesystem::create_directories(corpus / folder);
  }
  const std::filesystem::path models = corpus / "models";
  save(explore(), models / "explore.json");
  save(reflex(), models / "reflex.json");
  save(process(), models / "gaussian_process.json");
  save(gel_force(), models / "gel_force.json");
  save(hue(HueForm::kEquation4), models / "hue_line.json");
  save(hue(HueForm::kIsotropic), models / "hue_isotropic.json");
  save(hue(HueForm::kPolynomial), models / "hue_polynomial.json");
  save(classifier(), models / "material_classifier.json");
  save(delays(), models / "time_delay_network.json");
  save(GraspForceModel{delays(), GraspForceError{0.25, 0.125, 0.5}}, models / "grasp_force.json");
  save(stiffness(), models / "stiffness.json");
  save(darkness(), models / "darkness.dark");
  save(height(), models / "height.gel");
  save(compliance(), models / "marker_compliance.bin");
  save(map(), models / "tactile.map");
  save(colour(), models / "colour.colour");
  save(softness(), models / "softness.json");
  save(texture(), models / "texture.bin");
  for (const char* name :
       {"events/space.txt", "events/comma.csv", "events/evt3.raw", "events/lz4.aedat4", "event_hdf5/dsec.h5"}) {
    EventWriter writer(corpus / name, {34, 26}, "touchstone 0");
    writer.append(events());
    writer.close();
  }
  write_set_up_results(corpus / "set_up_results");
  write_truth(corpus / "blocks/truth.h5");
  write_block(corpus / "blocks/block.h5");
  write_pictures(corpus / "pictures");
}

}  // namespace
}  // namespace touchstone::fuzz

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: fuzz_make_seeds tests/fuzz/corpus\n");
    return 2;
  }
  touchstone::fuzz::write_seeds(arguments[1]);
  return 0;
}
