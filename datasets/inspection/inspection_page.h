#pragma once
// A data set as one page that needs nothing else: pictures, histograms, truth over pictures, why it was made as it was.

#include <optional>
#include <string>

#include "datasets/inspection/inspected_set.h"
#include "datasets/jobs/prepared_job.h"
#include "sim/files/gltf_writer.h"

namespace touchstone::datasets {

/// three.js and two of its examples, as text: what shows the 3D view.
struct ViewerScripts {
  std::string three, gltf_loader, orbit_controls;
};

/// How much of a set its page shows.
struct InspectionOptions {
  int tiles_per_scene = 6;  ///< of the contact sheet
  int most_tiles = 60;
  int columns = 6;
  int tile_width = 200;
  int most_overlays = 8;  ///< pictures with their truth drawn over: one a scene, where it's pressed hardest
};

/// The job that a set was made of, read from where it's thought to lie, if the job and all that it names are those of
/// the set; else nothing, and why in `note`. @param file empty: the shipped job of that file's name
std::optional<PreparedJob> job_of_set(const InspectedSet& set, const std::filesystem::path& file, std::string& note);

/// A sample in 3D: the gel's surface, free and in contact, beads, the force (10 mm a newton at most, shorter where that
/// would leave the gel), and with `scene` the object.
std::vector<sim::GltfPart> sample_parts(const InspectedSample& sample, const InspectedGel& gel,
                                        const PreparedScene* scene);

/// The page, HTML in UTF-8. Without `job` all that is drawn over pictures is the contact's mask and the 3D view has no
/// object; without `viewer` there is no 3D view. The same set makes the same bytes.
/// @param note what is to be said of `job`, as job_of_set said
/// @throws Error naming a file of the set that can't be read
std::string inspection_page(const InspectedSet& set, const std::optional<PreparedJob>& job, const std::string& note,
                            const std::optional<ViewerScripts>& viewer, const InspectionOptions& options = {});

}  // namespace touchstone::datasets
