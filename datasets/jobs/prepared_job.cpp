#include "datasets/jobs/prepared_job.h"

#include "core/text_file.h"

namespace touchstone::datasets {

PreparedJob prepare_job(const std::filesystem::path& file) {
  PreparedJob prepared;
  prepared.file = file;
  prepared.job = read_job(file);
  prepared.text = read_text_file(file);
  for (const JobScene& entry : prepared.job.scenes) {
    PreparedScene scene;
    scene.entry = entry;
    scene.spec = sim::read_scene(entry.scene);
    scene.spec.seed = prepared.job.seed;
    if (entry.start_mm) scene.spec.motion.start_mm = *entry.start_mm;
    if (prepared.job.outputs) scene.spec.outputs = *prepared.job.outputs;
    scene.spec.accuracy = sim::merged(prepared.job.accuracy, scene.spec.accuracy);
    scene.plan = sim::make_plan(scene.spec);
    // Reads and checks a mesh or relief file now, before anything is written.
    for (const sim::MovedObject& moved : sim::moved_objects(scene.spec)) sim::contact_shape(moved.object);
    if (!prepared.scenes.empty()) {
      const PreparedScene& first = prepared.scenes.front();
      if (!std::filesystem::equivalent(scene.spec.device.where.file, first.spec.device.where.file)) {
        fail_at(entry.where, "scenes: '{}' shows the device of {}, but '{}' that of {}; a data set holds one device",
                entry.name, scene.spec.device.where.file, first.entry.name, first.spec.device.where.file);
      }
      if (scene.spec.more_objects.size() != first.spec.more_objects.size()) {
        fail_at(entry.where, "scenes: '{}' has {} objects, but '{}' has {}; all scenes of a data set have as many",
                entry.name, 1 + scene.spec.more_objects.size(), first.entry.name, 1 + first.spec.more_objects.size());
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

}  // namespace touchstone::datasets
