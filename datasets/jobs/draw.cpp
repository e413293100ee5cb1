#include "datasets/jobs/draw.h"

#include <algorithm>

#include "core/error.h"
#include "core/short_text.h"
#include "datasets/jobs/input_files.h"
#include "datasets/jobs/job.h"

namespace touchstone::datasets {
namespace {

constexpr int kMostUnits = 100'000;
constexpr double kMostPieces = 1e9;
constexpr int kMostSamplesAFile = 1000;       // all of a file's samples are in memory at once
constexpr std::int64_t kMostFiles = 900'000;  // their names and checksums are in memory at once
constexpr double kLargestTilt_deg = 60.0;

bool& wanted_of(DrawnOutputs& outputs, DrawnOutput output) {
  switch (output) {
    case DrawnOutput::frame:
      return outputs.frame;
    case DrawnOutput::height:
      return outputs.height;
    case DrawnOutput::contact:
      return outputs.contact;
    case DrawnOutput::beads:
      return outputs.beads;
    case DrawnOutput::markers:
      return outputs.markers;
    case DrawnOutput::traction:
      return outputs.traction;
    case DrawnOutput::events:
      return outputs.events;
    case DrawnOutput::statistics:
      return outputs.statistics;
  }
  TS_ASSERT(false);
}

}  // namespace

EnumNames<DrawnOutput> enum_names(DrawnOutput) {
  return {{"frame", DrawnOutput::frame},   {"height", DrawnOutput::height},        {"contact", DrawnOutput::contact},
          {"beads", DrawnOutput::beads},   {"markers", DrawnOutput::markers},      {"traction", DrawnOutput::traction},
          {"events", DrawnOutput::events}, {"statistics", DrawnOutput::statistics}};
}

void fields(YamlReader& in, NumberVariation& vary) {
  vary.where = in.where();
  in.required("path", vary.path);
  in.exactly_one_of({"set", "times", "plus"});
  for (const auto& [name, how] : {std::pair{"set", VariationKind::set}, std::pair{"times", VariationKind::times},
                                  std::pair{"plus", VariationKind::plus}}) {
    if (!in.has(name)) continue;
    vary.how = how;
    in.required(name, vary.spread);
  }
}

void fields(YamlReader& in, UnitsSpec& units) {
  in.required("count", units.count, Allowed::within(1, kMostUnits));
  in.optional("vary", units.vary);
}

void fields(YamlReader& in, DrawnObjectSpec& object) {
  object.where = in.where();
  object.file = existing_file(in, "file");
  in.optional("weight", object.weight, Allowed::above(0.0));
  in.optional("vary", object.vary);
  in.optional("pieces", object.pieces, Allowed::within(1, kMostPieces));
  if (object.pieces && object.vary.empty()) {
    fail_at(in.where("pieces"), "{}pieces: {} pieces that differ in nothing; give `vary`, too", in.context(),
            *object.pieces);
  }
}

void fields(YamlReader& in, PlaceSpec& place) {
  in.required("x", place.x);
  in.required("y", place.y);
}

void fields(YamlReader& in, DrawSpec& draw) {
  draw.device = existing_file(in, "device");
  in.optional("units", draw.units);
  in.required("objects", draw.objects);
  in.required("place_mm", draw.place_mm);
  in.optional("turn_deg", draw.turn_deg, Allowed::within(-360.0, 360.0));
  in.optional("tilt_deg", draw.tilt_deg, Allowed::within(0.0, kLargestTilt_deg));
  in.optional("tilt_axis_deg", draw.tilt_axis_deg, Allowed::within(-360.0, 360.0));
  in.optional("force_N", draw.force_N, Allowed::above(0.0));
  in.optional("depth_mm", draw.depth_mm, Allowed::above(0.0));
  in.exactly_one_of({"force_N", "depth_mm"});
  in.optional("drag_mm", draw.drag_mm, Allowed::at_least(0.0));
  in.optional("drag_toward_deg", draw.drag_toward_deg, Allowed::within(-360.0, 360.0));
  in.optional("deepest_mm", draw.deepest_mm, Allowed::above(0.0));
  if (draw.objects.empty()) fail_at(in.where("objects"), "draw.objects: has no object; at least one is needed");
}

void fields(YamlReader& in, DrawnEffects& effects) {
  in.optional("elasticity", effects.elasticity);
  in.optional("fine_relief", effects.fine_relief);
  in.optional("interreflection", effects.interreflection);
  in.optional("diffraction", effects.diffraction);
}

void fields(YamlReader& in, DrawJob& job) {
  job.where = in.where();
  in.required("name", job.name);
  if (!is_folder_name(job.name)) {
    fail_at(in.where("name"), "name: '{}' isn't a name; allowed are up to 100 letters, digits, - and _",
            short_text(job.name));
  }
  in.required("seed", job.seed);
  in.required("samples", job.samples, Allowed::at_least(1));
  in.optional("samples_per_file", job.samples_per_file, Allowed::within(1, kMostSamplesAFile));
  in.optional("licence", job.licence);
  in.required("draw", job.draw);
  std::vector<DrawnOutput> outputs;
  in.required("outputs", outputs);
  job.outputs.where = in.where("outputs");
  for (const DrawnOutput output : outputs) {
    bool& wanted = wanted_of(job.outputs, output);
    if (wanted) fail_at(job.outputs.where, "outputs: one stands here a second time");
    wanted = true;
  }
  in.optional("splits", job.splits);
  in.optional("membrane_um", job.membrane_um, Allowed::within(1.0, 1000.0));
  in.optional("interreflection_tolerance", job.interreflection_tolerance, Allowed::within(0.0, 1.0));
  in.optional("guide_sectors", job.guides.sectors, Allowed::within(1, 8));
  in.optional("guide_slices", job.guides.slices, Allowed::within(1, 4));
  in.optional("accuracy", job.accuracy);
  in.optional("effects", job.effects);
  in.optional("edge_side", job.edge_side);
  if (job.edge_side != 1 && job.edge_side != 2 && job.edge_side != 4) {
    fail_at(in.where("edge_side"), "edge_side: {} is not allowed; allowed is one of: 1, 2, 4", job.edge_side);
  }
  if (job.samples / job.samples_per_file > kMostFiles) {
    fail_at(in.where("samples"), "samples: {} samples, {} a file; allowed are {} files", job.samples,
            job.samples_per_file, kMostFiles);
  }
  if (job.draw.units.count > job.samples) {
    fail_at(in.where("samples"), "samples: {} samples of {} units; each unit needs one at least", job.samples,
            job.draw.units.count);
  }
}

DrawJob read_draw_job(const std::filesystem::path& file) {
  return read_yaml<DrawJob>(file);
}

bool is_draw_job_file(const std::filesystem::path& file) {
  return YamlReader::open(file).has("draw");
}

}  // namespace touchstone::datasets
