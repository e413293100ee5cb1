#include "datasets/inspection/inspected_set.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <optional>

#include "core/error.h"
#include "core/hdf5_file.h"
#include "core/whole_file.h"
#include "datasets/inspection/inspected_draw.h"
#include "datasets/jobs/job.h"
#include "datasets/sets/manifest.h"
#include "datasets/sets/truth_file.h"
#include "sim/files/image_file.h"

namespace touchstone::datasets {
namespace {

using nlohmann::ordered_json;

std::vector<Eigen::Vector3d> points(const std::vector<double>& values) {
  std::vector<Eigen::Vector3d> all;
  for (std::size_t i = 0; i + 2 < values.size(); i += 3) all.emplace_back(values[i], values[i + 1], values[i + 2]);
  return all;
}

InspectedScene scene_of(const ordered_json& json) {
  InspectedScene scene;
  scene.name = json.at("name");
  scene.split = name_of(split_named(json.at("split")));
  scene.device = json.at("device");
  scene.object = json.at("object");
  scene.first_sample = json.at("first_sample");
  scene.samples = json.at("samples");
  for (const auto& [name, has] : json.at("outputs").items()) {
    if (has.get<bool>()) scene.outputs.push_back(name);
  }
  for (const ordered_json& effect : json.at("plan")) {
    scene.plan.push_back({effect.at("effect"), effect.at("on"), effect.at("why"), effect.at("cost")});
  }
  if (json.contains("light")) {
    for (const ordered_json& light : json.at("light")) scene.light.emplace_back(light.at("how"), light.at("samples"));
  }
  return scene;
}

/// What dataset.json has beyond Manifest.
void read_more(const std::filesystem::path& file, InspectedSet& set) {
  try {
    const ordered_json json = ordered_json::parse(read_whole_file(file));
    set.job_file = json.at("job").at("file");
    set.job_text = json.at("job").at("text");
    for (const ordered_json& scene : json.at("scenes")) set.scenes.push_back(scene_of(scene));
    for (const ordered_json& array : json.at("arrays")) {
      std::string axes = array.at("axes");
      axes += ": " + array.at("shape").dump();
      set.arrays.push_back({array.at("path"), axes, array.at("unit")});
    }
    if (json.contains("timings")) {
      for (const auto& [stage, seconds] : json.at("timings").at("wall_s").items())
        set.timings.emplace_back(stage, seconds);
    }
  } catch (const nlohmann::json::exception& error) {
    fail("{}: isn't a whole manifest ({})", file.string(), error.what());
  }
}

std::vector<double> column(const Hdf5Reader& file, const std::filesystem::path& path, const std::string& name,
                           std::size_t width, std::size_t count) {
  auto values = file.read<double>(name).values;
  if (values.size() != width * count) fail("{}: '{}' isn't as long as the others", path.string(), name);
  return values;
}

/// Also walks through what read_inspected_gel reads later.
void read_columns(const std::filesystem::path& path, InspectedSet& set) {
  const Hdf5Reader file(path);
  const TruthTable table = truth_table_in(file, path);
  const std::size_t count = table.t_us.size();
  const auto displacement_error = column(file, path, "/error/displacement_mm", 1, count);
  set.samples = read_sample_columns(file, path, "/error/force_N", count);
  for (const char* of_gel : {"/gel_vertices_mm", "/gel_triangles", "/surface_displacement_mm", "/contact",
                             "/bead_rest_mm", "/bead_displacement_mm"}) {
    if (file.has(of_gel)) file.walk_rows(of_gel);
  }
  for (std::size_t i = 0; i < count; ++i) {
    set.samples[i].scene = table.scene[i];
    set.samples[i].frame = table.frame[i];
    set.samples[i].t_us = table.t_us[i];
    set.samples[i].displacement_error = displacement_error[i];
  }
}

/// A picture of a sample: `of` is "frames", "ideal", "pixels"; none if the set has no such file.
std::optional<std::filesystem::path> picture_file(const InspectedSet& set, std::size_t sample, const std::string& of,
                                                  const std::string& ending) {
  const InspectedSample& at = set.samples[sample];
  const std::filesystem::path file =
      set.folder / picture_name(of, set.scenes[static_cast<std::size_t>(at.scene)].name, at.frame, ending);
  if (!std::filesystem::is_regular_file(file)) return std::nullopt;
  return file;
}

}  // namespace

std::vector<InspectedSample> read_sample_columns(const Hdf5Reader& file, const std::filesystem::path& path,
                                                 const std::string& force_error, std::size_t count) {
  const auto wrench = column(file, path, "/wrench", 6, count);
  const auto pose = column(file, path, "/pose", 12, count);
  const auto error = column(file, path, force_error, 3, count);
  const auto area = column(file, path, "/contact_area_mm2", 1, count);
  const auto strain = column(file, path, "/largest_strain", 1, count);
  const auto under_resolved = file.read<std::uint8_t>("/under_resolved").values;
  if (under_resolved.size() != count) fail("{}: '/under_resolved' isn't as long as the others", path.string());
  std::vector<InspectedSample> samples(count);
  for (std::size_t i = 0; i < count; ++i) {
    InspectedSample& sample = samples[i];
    sample.wrench = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(wrench.data() + 6 * i);
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> placed(pose.data() + 12 * i);
    sample.gel_from_object = {placed.leftCols<3>(), placed.col(3)};
    sample.force_error = Eigen::Map<const Eigen::Vector3d>(error.data() + 3 * i);
    sample.contact_area = area[i];
    sample.largest_strain = strain[i];
    sample.under_resolved = under_resolved[i] != 0;
  }
  return samples;
}

cv::Mat inspected_frame(const InspectedSet& set, std::size_t sample) {
  if (set.drawn) return drawn_frame(set, sample);
  for (const char* of : {"frames", "ideal"}) {
    if (const auto file = picture_file(set, sample, of, "png")) return sim::read_image(*file);
  }
  return {};
}

cv::Mat inspected_contact(const InspectedSet& set, std::size_t sample) {
  if (set.drawn) return drawn_contact(set, sample);
  const auto file = picture_file(set, sample, "pixels", "exr");
  if (!file) return {};
  const sim::LinearImage truth = sim::read_exr(*file);
  const auto at = std::find(truth.channel_names.begin(), truth.channel_names.end(), "contact.Y");
  if (at == truth.channel_names.end()) return {};
  cv::Mat channel;
  cv::extractChannel(truth.image, channel, static_cast<int>(at - truth.channel_names.begin()));
  return channel > 0.5;
}

std::string InspectedSet::name_of_sample(std::size_t sample) const {
  return fmt::format("{}{} {}", scenes[static_cast<std::size_t>(samples[sample].scene)].name, drawn ? ", sample" : "",
                     samples[sample].frame);
}

InspectedSet read_inspected_set(const std::filesystem::path& folder) {
  const Manifest manifest = read_manifest(folder);
  InspectedSet set;
  set.drawn = manifest.source == SetSource::draw;
  set.folder = folder;
  set.job_name = manifest.name;
  set.content_sha256 = manifest.content_sha256;
  set.job_sha256 = manifest.run.job_sha256;
  set.inputs_sha256 = manifest.run.inputs_sha256;
  set.version = manifest.run.version;
  set.processor = manifest.run.processor;
  set.blocks = manifest.blocks;
  set.files = static_cast<std::int64_t>(manifest.files.size());
  for (const WrittenFile& file : manifest.files) set.bytes += static_cast<std::int64_t>(file.bytes);
  if (set.drawn) {
    verify_files(folder, manifest);
    read_drawn_samples(manifest, set);
    return set;
  }
  read_more(folder / "dataset.json", set);
  const std::filesystem::path truth = folder / "truth.h5";
  read_hdf5(truth, [&] { read_columns(truth, set); });
  if (static_cast<std::int64_t>(set.samples.size()) != manifest.samples) {
    fail("{}: truth.h5 has {} samples, dataset.json {}", folder.string(), set.samples.size(), manifest.samples);
  }
  for (const InspectedSample& sample : set.samples) {
    if (sample.scene >= static_cast<int>(set.scenes.size())) {
      fail("{}: truth.h5 has a scene {}, dataset.json {} scenes", folder.string(), sample.scene, set.scenes.size());
    }
  }
  return set;
}

InspectedGel read_inspected_gel(const InspectedSet& set, std::size_t sample) {
  if (set.drawn) return drawn_gel(set, sample);
  const std::filesystem::path path = set.folder / "truth.h5";
  const Hdf5Reader file(path);
  const auto row = static_cast<std::int64_t>(sample);
  InspectedGel gel;
  gel.rest = points(file.read<double>("/gel_vertices_mm").values);
  const auto corners = file.read<std::int32_t>("/gel_triangles").values;
  const auto moved = points(file.read_rows<double>("/surface_displacement_mm", row, 1).values);
  const auto touches = file.read_rows<std::uint8_t>("/contact", row, 1).values;
  gel.beads = points(file.read<double>("/bead_rest_mm").values);
  const auto beads_moved = points(file.read_rows<double>("/bead_displacement_mm", row, 1).values);
  const std::size_t vertices = gel.rest.size();
  if (moved.size() != vertices || touches.size() != vertices || beads_moved.size() != gel.beads.size()) {
    fail("{}: the arrays of the gel's surface aren't of one length", path.string());
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i] < 0 || static_cast<std::size_t>(corners[i]) >= vertices) {
      fail("{}: '/gel_triangles' names the vertex {}; there are {}", path.string(), corners[i], vertices);
    }
    if (i % 3 == 2) gel.triangles.push_back({corners[i - 2], corners[i - 1], corners[i]});
  }
  for (std::size_t i = 0; i < vertices; ++i) {
    gel.displaced.emplace_back(gel.rest[i] + moved[i]);
    gel.contact.push_back(touches[i] != 0);
  }
  for (std::size_t i = 0; i < gel.beads.size(); ++i) gel.beads[i] += beads_moved[i];
  return gel;
}

}  // namespace touchstone::datasets
