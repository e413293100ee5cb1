#include "datasets/sets/truth_file.h"

#include <algorithm>

#include "core/error.h"
#include "core/hdf5_file.h"

namespace touchstone::datasets {
namespace {

constexpr const char* kFormat = "touchstone-truth";
constexpr std::int64_t kFormatVersion = 1;

/// Rows of a matrix of three columns, one after the other, in single precision: fields are known to a part in 10^4 at
/// best, and take most of the file.
std::vector<float> rows_of(const Eigen::MatrixX3d& field) {
  std::vector<float> rows(static_cast<std::size_t>(field.size()));
  for (Eigen::Index i = 0; i < field.rows(); ++i) {
    for (Eigen::Index a = 0; a < 3; ++a) rows[static_cast<std::size_t>(3 * i + a)] = static_cast<float>(field(i, a));
  }
  return rows;
}

/// 3 x 4, row by row: the rotation, then the position.
std::vector<double> numbers_of(const RigidTransform& pose) {
  std::vector<double> numbers;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) numbers.push_back(pose.rotation(i, j));
    numbers.push_back(pose.translation[i]);
  }
  return numbers;
}

std::vector<double> flat(const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> values;
  for (const Eigen::Vector3d& p : points) values.insert(values.end(), {p.x(), p.y(), p.z()});
  return values;
}

}  // namespace

struct TruthFileWriter::Parts {
  Hdf5Writer file;
  TruthHeader header;
  std::int64_t nodes = 0;
  std::int64_t beads = 0;
  std::int64_t next = 0;
  std::vector<ArrayShape> arrays;

  explicit Parts(const std::filesystem::path& path) : file(path) {}

  void note(const Hdf5Description& description, std::int64_t rows, const std::vector<std::int64_t>& row_shape) {
    ArrayShape array{description.path, description.unit, description.shape, {rows}};
    array.shape.insert(array.shape.end(), row_shape.begin(), row_shape.end());
    arrays.push_back(std::move(array));
  }
  template <typename T>
  void column(const Hdf5Description& description, const std::vector<std::int64_t>& row_shape) {
    file.add_rows<T>(description, header.samples, row_shape);
    note(description, header.samples, row_shape);
  }
  template <typename T>
  void constant(const Hdf5Description& description, std::int64_t rows, const std::vector<std::int64_t>& row_shape,
                const std::vector<T>& values) {
    file.write<T>(description, rows, row_shape, values);
    note(description, rows, row_shape);
  }
  template <typename T>
  void value(const std::string& path, T one) {
    file.write_row<T>(path, next, std::span<const T>(&one, 1));
  }
  template <typename T>
  void row(const std::string& path, const std::vector<T>& values) {
    file.write_row<T>(path, next, values);
  }

  void make_constants(const fem::Compliance& gel) {
    const Hdf5Description names{"/scene_name", "1", "scenes", "", "Names of the scenes, which `scene` counts from 0."};
    file.write_texts(names, header.scenes);
    note(names, static_cast<std::int64_t>(header.scenes.size()), {});
    constant<double>({"/bead_rest_mm", "mm", "beads x 3", "gel",
                      "Centres of the beads without load, row by row of their grid as the picture shows it."},
                     beads, {3}, flat(header.bead_rest));
    constant<double>({"/gel_vertices_mm", "mm", "nodes x 3", "gel", "Nodes of the outer surface without load."}, nodes,
                     {3}, flat(gel.vertices));
    std::vector<std::int32_t> corners;
    for (const auto& triangle : gel.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
    constant<std::int32_t>(
        {"/gel_triangles", "1", "triangles x 3", "", "Nodes of each triangle of the outer surface, normal outwards."},
        static_cast<std::int64_t>(gel.triangles.size()), {3}, corners);
  }

  void make_columns() {
    column<std::int64_t>({"/t_us", "us", "samples", "", "Time since the scene's first frame."}, {});
    column<std::int32_t>({"/scene", "1", "samples", "", "Number of the sample's scene, from 0."}, {});
    column<std::uint8_t>({"/split", "1", "samples", "", "0 train, 1 validate, 2 test."}, {});
    column<std::int32_t>({"/frame", "1", "samples", "", "Number of the frame within its scene, from 0."}, {});
    column<double>({"/pose", "mm (last column)", "samples x 3 x 4", "gel",
                    "gel_from_object: rotation matrix, then the position of the object's origin."},
                   {3, 4});
    column<double>({"/wrench", "N, N mm", "samples x 6", "gel",
                    "On the object, by the gel: force x y z, torque x y z about the gel frame's origin."},
                   {6});
    column<double>({"/objects/pose", "mm (last column)", "samples x objects x 3 x 4", "gel",
                    "gel_from_object of each object of the scene; the first one's is also in /pose."},
                   {header.objects, 3, 4});
    column<double>({"/objects/wrench", "N, N mm", "samples x objects x 6", "gel",
                    "On each object, by the gel: force x y z, torque x y z about the gel frame's origin."},
                   {header.objects, 6});
    column<float>({"/bead_displacement_mm", "mm", "samples x beads x 3", "gel", "Displacement of each bead's centre."},
                  {beads, 3});
    column<float>({"/surface_displacement_mm", "mm", "samples x nodes x 3", "gel",
                   "Displacement of each node of the outer surface."},
                  {nodes, 3});
    column<float>({"/traction_MPa", "MPa", "samples x nodes x 3", "gel", "On the gel, at each node, by the objects."},
                  {nodes, 3});
    column<std::uint8_t>({"/contact", "1", "samples x nodes", "", "1 where the node touches an object."}, {nodes});
    column<std::uint8_t>({"/node_state", "1", "samples x nodes", "", "0 open, 1 stick, 2 slip."}, {nodes});
    column<double>({"/contact_area_mm2", "mm^2", "samples", "", "Area of contact."}, {});
    column<double>({"/largest_strain", "1", "samples", "",
                    "Largest strain or tilt at the outer surface: linear theory is first-order in it."},
                   {});
    column<std::uint8_t>({"/under_resolved", "1", "samples", "",
                          "1 where the contact spans too few nodes for its force to be exact to a percent."},
                         {});
    column<double>(
        {"/residual_penetration_mm", "mm", "samples", "", "Error bar: largest overlap that the contact solver left."},
        {});
    column<double>(
        {"/residual_tension_MPa", "MPa", "samples", "", "Error bar: largest pull that the contact solver left."}, {});
    column<double>({"/residual_friction_cone", "1", "samples", "",
                    "Error bar: largest violation of Coulomb's cone, relative to its radius at the largest pressure."},
                   {});
    column<double>({"/residual_force_N", "N", "samples", "",
                    "Error bar: largest difference to a wanted force, under force control."},
                   {});
    column<double>({"/lookup_error_mm", "mm", "samples", "",
                    "Error bar: how far the contact patch lies from where the gap was looked up."},
                   {});
    column<double>({"/error/force_N", "N", "samples x 3", "gel",
                    "Standard error from the mesh of the force at this pose; where an axis is led by force, what the "
                    "pose's error amounts to."},
                   {3});
    column<double>({"/error/displacement_mm", "mm", "samples", "",
                    "Standard error from the mesh of the outer surface's displacement within twice the contact's "
                    "radius."},
                   {});
    column<double>({"/error/bead_mm", "mm", "samples", "",
                    "Standard error from the mesh of the displacement of the bead that is furthest off."},
                   {});
    column<double>({"/error/traction_MPa", "MPa", "samples", "",
                    "Standard error from the mesh of the traction in contact, root mean square over it."},
                   {});
    column<double>({"/residual_contact", "1", "samples", "",
                    "Error bar: how far the contact laws are from being met, relative to the largest pressure."},
                   {});
  }
};

TruthFileWriter::TruthFileWriter(const std::filesystem::path& file, const TruthHeader& header,
                                 const fem::Compliance& gel)
    : parts_(std::make_unique<Parts>(file)) {
  parts_->header = header;
  parts_->nodes = static_cast<std::int64_t>(gel.vertices.size());
  parts_->beads = static_cast<std::int64_t>(header.bead_rest.size());
  parts_->file.set_attribute("format", kFormat);
  parts_->file.set_attribute("format_version", kFormatVersion);
  parts_->file.set_attribute("program", "touchstone " + header.version);
  parts_->file.set_attribute("job", header.job_name);
  parts_->make_constants(gel);
  parts_->make_columns();
}

TruthFileWriter::~TruthFileWriter() = default;

void TruthFileWriter::append(int scene, Split split, const sim::Truth& truth) {
  Parts& to = *parts_;
  const fem::PressState& press = truth.press;
  TS_ASSERT(to.next < to.header.samples && press.traction.rows() == to.nodes);
  to.value<std::int64_t>("/t_us", truth.t_us);
  to.value<std::int32_t>("/scene", scene);
  to.value<std::uint8_t>("/split", static_cast<std::uint8_t>(split));
  to.value<std::int32_t>("/frame", truth.frame);
  std::vector<double> poses = numbers_of(press.gel_from_object);
  std::vector<double> wrenches(press.wrench.data(), press.wrench.data() + 6);
  to.row<double>("/pose", poses);
  to.row<double>("/wrench", wrenches);
  TS_ASSERT(to.header.objects == 1 || to.header.objects == static_cast<std::int64_t>(press.bodies.size()));
  for (std::int64_t k = 1; k < to.header.objects; ++k) {
    const fem::BodyState& body = press.bodies[static_cast<std::size_t>(k)];
    const std::vector<double> pose = numbers_of(body.gel_from_object);
    poses.insert(poses.end(), pose.begin(), pose.end());
    wrenches.insert(wrenches.end(), body.wrench.data(), body.wrench.data() + 6);
  }
  to.row<double>("/objects/pose", poses);
  to.row<double>("/objects/wrench", wrenches);
  to.row<float>("/bead_displacement_mm", rows_of(press.bead_displacement));
  to.row<float>("/surface_displacement_mm", rows_of(press.surface_displacement));
  to.row<float>("/traction_MPa", rows_of(press.traction));
  std::vector<std::uint8_t> contact;
  std::vector<std::uint8_t> state;
  for (const fem::NodeState node : press.node_state) {
    contact.push_back(node == fem::NodeState::open ? 0 : 1);
    state.push_back(static_cast<std::uint8_t>(node));
  }
  to.row<std::uint8_t>("/contact", contact);
  to.row<std::uint8_t>("/node_state", state);
  to.value<double>("/contact_area_mm2", press.contact_area);
  to.value<double>("/largest_strain", press.largest_strain);
  to.value<std::uint8_t>("/under_resolved", press.under_resolved ? 1 : 0);
  to.value<double>("/residual_penetration_mm", press.largest_penetration);
  to.value<double>("/residual_tension_MPa", press.largest_tension);
  to.value<double>("/residual_friction_cone", press.cone_violation);
  to.value<double>("/residual_force_N", press.force_residual);
  to.value<double>("/residual_contact", press.contact_residual);
  to.value<double>("/lookup_error_mm", press.lookup_error);
  to.row<double>("/error/force_N", {truth.error.force.data(), truth.error.force.data() + 3});
  to.value<double>("/error/displacement_mm", truth.error.displacement);
  to.value<double>("/error/bead_mm", truth.error.beads);
  to.value<double>("/error/traction_MPa", truth.error.traction);
  ++to.next;
}

void TruthFileWriter::close() {
  TS_ASSERT(parts_->next == parts_->header.samples);
  parts_->file.close();
}

const std::vector<ArrayShape>& TruthFileWriter::arrays() const {
  return parts_->arrays;
}

TruthTable truth_table_in(const Hdf5Reader& file, const std::filesystem::path& path) {
  if (file.text_attribute("/", "format") != kFormat) fail("{}: isn't a truth file", path.string());
  const std::int64_t version = file.integer_attribute("/", "format_version");
  if (version != kFormatVersion) {
    fail("{}: has format version {}; this program reads {}", path.string(), version, kFormatVersion);
  }
  TruthTable table;
  table.scene_names = file.read_texts("/scene_name");
  table.t_us = file.read<std::int64_t>("/t_us").values;
  const auto scene = file.read<std::int32_t>("/scene").values;
  const auto split = file.read<std::uint8_t>("/split").values;
  const auto frame = file.read<std::int32_t>("/frame").values;
  const auto wrench = file.read<double>("/wrench").values;
  const std::size_t samples = table.t_us.size();
  if (scene.size() != samples || split.size() != samples || frame.size() != samples || wrench.size() != 6 * samples) {
    fail("{}: its columns aren't of one length", path.string());
  }
  for (std::size_t i = 0; i < samples; ++i) {
    if (scene[i] < 0 || scene[i] >= static_cast<int>(table.scene_names.size()) || split[i] > 2) {
      fail("{}: sample {} has scene {} and split {}, which there aren't", path.string(), i, scene[i], split[i]);
    }
    table.scene.push_back(scene[i]);
    table.split.push_back(static_cast<Split>(split[i]));
    table.frame.push_back(frame[i]);
    table.wrench.push_back(Eigen::Map<const Eigen::Matrix<double, 6, 1>>(wrench.data() + 6 * i));
  }
  return table;
}

TruthTable read_truth_table(const std::filesystem::path& path) {
  return read_hdf5(path, [&path] { return truth_table_in(Hdf5Reader(path), path); });
}

}  // namespace touchstone::datasets
