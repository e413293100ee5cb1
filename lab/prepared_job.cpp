#include "lab/prepared_job.h"

#include "core/whole_file.h"

namespace touchstone::lab {

PreparedJob prepare_job(const std::filesystem::path& file) {
  PreparedJob prepared;
  prepared.file = file;
  prepared.job = read_job(file);
  prepared.text = read_whole_file(file);
  for (const JobScene& entry : prepared.job.scenes) {
    PreparedScene scene;
    scene.entry = entry;
    scene.spec = sim::read_scene(entry.scene);
    scene.spec.seed = prepared.job.seed;
    if (entry.start_mm) scene.spec.motion.start_mm = *entry.start_mm;
    if (prepared.job.outputs) scene.spec.outputs = *prepared.job.outputs;
    scene.plan = sim::make_plan(scene.spec);
    // Reads and checks a mesh or relief file now, before anything is written.
    sim::contact_shape(scene.spec.object);
    if (!prepared.scenes.empty()) {
      const PreparedScene& first = prepared.scenes.front();
      if (!std::filesystem::equivalent(scene.spec.device.where.file, first.spec.device.where.file)) {
        fail_at(entry.where, "scenes: '{}' shows the device of {}, but '{}' that of {}; a data set holds one device",
                entry.name, scene.spec.device.where.file, first.entry.name, first.spec.device.where.file);
      }
    }
    scene.first_sample = prepared.samples;
    scene.samples = scene.spec.motion.frame_count();
    prepared.samples += scene.samples;
    prepared.scenes.push_back(std::move(scene));
  }
  prepared.inputs = input_files(file);
  return prepared;
}

}  // namespace touchstone::lab
