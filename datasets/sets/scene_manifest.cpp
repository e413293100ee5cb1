#include "datasets/sets/scene_manifest.h"

#include <cmath>

#include "core/error.h"
#include "datasets/sets/manifest_parts.h"

namespace touchstone::datasets {
namespace {

using nlohmann::ordered_json;

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

}  // namespace

std::string scene_manifest(const PreparedJob& job, const RunIdentity& identity, const fem::ComplianceReport& gel,
                           const std::vector<ArrayShape>& arrays, const std::vector<WrittenFile>& files,
                           const CountedWork& work, const RunTimings* timings) {
  ManifestHead head;
  head.source = SetSource::scenes;
  head.name = job.job.name;
  head.licence = job.job.licence;
  head.seed = job.job.seed;
  head.samples = job.samples;
  head.job_file = job.file.filename().string();
  head.job_text = job.text;
  head.inputs = &job.inputs;
  for (const PreparedScene& scene : job.scenes) {
    head.splits[static_cast<std::size_t>(scene.entry.split)] += scene.samples;
  }
  ordered_json manifest = manifest_json(head, identity);
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
    manifest["files"].push_back(file_json(file));
  }
  if (timings != nullptr) {
    const auto by_stage = [](const std::vector<std::pair<std::string, double>>& all) {
      ordered_json stages = ordered_json::object();
      for (const auto& [stage, seconds] : all) stages[stage] = seconds;
      return stages;
    };
    manifest["timings"] = {
        {"wall_s", by_stage(timings->stages)}, {"threads", timings->threads}, {"samples_made", timings->samples_made}};
    if (!timings->predicted.empty()) manifest["timings"]["predicted_s"] = by_stage(timings->predicted);
  }
  return manifest_text(std::move(manifest));
}

}  // namespace touchstone::datasets
