#include "datasets/sets/manifest.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"

namespace touchstone::datasets {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFormat = "touchstone-dataset";
constexpr int kFormatVersion = 1;

ordered_json plan_json(const sim::Plan& plan) {
  ordered_json table = ordered_json::array();
  for (const sim::Effect& effect : plan.effects) {
    table.push_back({{"effect", effect.name}, {"on", effect.on}, {"why", effect.why}, {"cost", effect.cost}});
  }
  return table;
}

ordered_json scene_json(const PreparedScene& scene, const std::filesystem::path& folder) {
  const sim::SceneSpec& spec = scene.spec;
  ordered_json json = {{"name", scene.entry.name},
                       {"file", scene.entry.scene.lexically_relative(folder).generic_string()},
                       {"split", name_of(scene.entry.split)},
                       {"seed", spec.seed},
                       {"first_sample", scene.first_sample},
                       {"samples", scene.samples},
                       {"device", spec.device.name},
                       {"object", spec.object.name},
                       {"start_mm", {spec.motion.start_mm.x(), spec.motion.start_mm.y(), spec.motion.start_mm.z()}},
                       {"frame_rate_Hz", spec.motion.frame_rate_Hz},
                       {"outputs",
                        {{"frames", scene.plan.camera && spec.outputs.frames},
                         {"ideal", scene.plan.camera && spec.outputs.ideal},
                         {"radiance", scene.plan.camera && spec.outputs.radiance},
                         {"height", spec.outputs.height}}}};
  for (const auto& [name, wanted] : {std::pair{"depth", spec.outputs.depth}, std::pair{"normals", spec.outputs.normals},
                                     std::pair{"ids", spec.outputs.ids}, std::pair{"contact", spec.outputs.contact},
                                     std::pair{"flow", spec.outputs.flow}, std::pair{"error", spec.outputs.error},
                                     std::pair{"events", spec.outputs.events}}) {
    json["outputs"][name] = scene.plan.camera && wanted;
  }
  if (scene.plan.camera && spec.device.camera) {
    json["picture"] = {{"width", spec.device.camera->width}, {"height", spec.device.camera->height}};
  }
  if (scene.plan.camera) {
    const render::Spectrum& centres = scene.plan.bands.centres_nm;
    json["band_centres_nm"] = std::vector<double>(centres.begin(), centres.end());
    if (scene.plan.bands.ranges) json["band_edges_nm"] = scene.plan.bands.ranges->edges_nm;
  }
  json["plan"] = plan_json(scene.plan);
  return json;
}

/// The checksum of all that isn't different in every run.
std::string content_checksum(ordered_json manifest) {
  manifest.erase("content_sha256");
  manifest.erase("timings");
  return sha256_of(manifest.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
}

}  // namespace

std::string picture_name(const std::string& folder, const std::string& scene, std::int64_t frame,
                         const std::string& ending) {
  return fmt::format("{}/{}/{:06}.{}", folder, scene, frame, ending);
}

std::string manifest_text(const PreparedJob& job, const RunIdentity& identity, const fem::ComplianceReport& gel,
                          const std::vector<ArrayShape>& arrays, const std::vector<WrittenFile>& files,
                          const CountedWork& work, const RunTimings* timings) {
  ordered_json manifest = {{"format", kFormat},
                           {"format_version", kFormatVersion},
                           {"content_sha256", ""},
                           {"program", {{"name", "touchstone"}, {"version", identity.version}}},
                           {"processor", identity.processor},
                           {"samples", job.samples}};
  manifest["job"] = {{"name", job.job.name},
                     {"seed", job.job.seed},
                     {"file", job.file.filename().string()},
                     {"sha256", identity.job_sha256},
                     {"inputs_sha256", identity.inputs_sha256},
                     {"text", job.text}};
  for (const InputFile& input : job.inputs) {
    manifest["inputs"].push_back({{"file", input.name}, {"sha256", input.sha256}});
  }
  manifest["gel_mesh"] = {{"tetrahedra", gel.tetrahedra},
                          {"unknowns", gel.unknowns},
                          {"smallest_dihedral_deg", std::round(100.0 * gel.smallest_dihedral_deg) / 100.0}};
  for (std::size_t i = 0; i < job.scenes.size(); ++i) {
    ordered_json scene = scene_json(job.scenes[i], job.file.parent_path());
    for (const auto& [how, samples] : work.light[i]) scene["light"].push_back({{"how", how}, {"samples", samples}});
    manifest["scenes"].push_back(std::move(scene));
  }
  for (const ArrayShape& array : arrays) {
    manifest["arrays"].push_back(
        {{"path", array.path}, {"unit", array.unit}, {"axes", array.axes}, {"shape", array.shape}});
  }
  manifest["work"] = {
      {"pictures", work.pictures}, {"pixels_traced", work.pixels_traced}, {"paths_traced", work.paths_traced}};
  for (const WrittenFile& file : files) {
    manifest["files"].push_back({{"file", file.name}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  }
  manifest["content_sha256"] = content_checksum(manifest);
  if (timings != nullptr) {
    ordered_json stages = ordered_json::object();
    for (const auto& [stage, seconds] : timings->stages) stages[stage] = seconds;
    manifest["timings"] = {
        {"wall_s", stages}, {"threads", timings->threads}, {"samples_rendered", timings->samples_rendered}};
  }
  return manifest.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

Manifest read_manifest(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "dataset.json";
  if (!std::filesystem::is_regular_file(file)) fail("{}: isn't a data set; it has no dataset.json", folder.string());
  try {
    const ordered_json json = ordered_json::parse(read_whole_file(file));
    if (json.at("format") != kFormat) fail("{}: isn't the manifest of a data set", file.string());
    if (json.at("format_version") != kFormatVersion) {
      fail("{}: has format version {}; this program reads {}", file.string(), json.at("format_version").dump(),
           kFormatVersion);
    }
    Manifest manifest;
    manifest.content_sha256 = json.at("content_sha256");
    if (manifest.content_sha256 != content_checksum(json)) {
      fail("{}: was changed; its content doesn't meet its content_sha256", file.string());
    }
    manifest.job_name = json.at("job").at("name");
    manifest.job_sha256 = json.at("job").at("sha256");
    manifest.inputs_sha256 = json.at("job").at("inputs_sha256");
    manifest.version = json.at("program").at("version");
    manifest.samples = json.at("samples");
    for (const ordered_json& scene : json.at("scenes")) {
      manifest.scenes.push_back({scene.at("name"), split_named(scene.at("split")), scene.at("first_sample"),
                                 scene.at("samples"), scene.at("outputs").at("frames")});
    }
    for (const ordered_json& entry : json.at("files")) {
      manifest.files.push_back({entry.at("file"), entry.at("sha256"), entry.at("bytes")});
    }
    return manifest;
  } catch (const nlohmann::json::exception& error) {
    fail("{}: isn't a whole manifest ({})", file.string(), error.what());
  }
}

void verify_files(const std::filesystem::path& folder, const Manifest& manifest) {
  std::vector<char> bad(manifest.files.size(), 0);
  tbb::parallel_for(std::size_t{0}, manifest.files.size(), [&](std::size_t i) {
    const std::filesystem::path file = folder / manifest.files[i].name;
    bad[i] = !std::filesystem::is_regular_file(file) || sha256_of_file(file) != manifest.files[i].sha256;
  });
  for (std::size_t i = 0; i < bad.size(); ++i) {
    if (bad[i] == 0) continue;
    const std::filesystem::path file = folder / manifest.files[i].name;
    if (!std::filesystem::exists(file)) fail("{}: is missing; dataset.json lists it", file.string());
    fail("{}: was changed; it doesn't meet its checksum in dataset.json", file.string());
  }
}

}  // namespace touchstone::datasets
