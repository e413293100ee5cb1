#include "bench/getfem_peer.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "bench/peer_process.h"
#include "core/error.h"
#include "core/whole_file.h"

namespace touchstone::bench {
namespace {

constexpr const char* kPython = "/usr/bin/python3";  // Debian's: another one may stand before it on PATH

}  // namespace

std::string why_no_peer() {
  if (probe({kPython, "-c", "import getfem, numpy"}) == 0) return {};
  return fmt::format("{} can't import getfem; script/bootstrap --bench installs Debian's python3-getfem", kPython);
}

void write_peer_mesh(const fem::TetMesh& mesh, const std::filesystem::path& file) {
  std::string text = fmt::format("vertices {}\n", mesh.vertices.size());
  for (const Eigen::Vector3d& x : mesh.vertices) text += fmt::format("{:.17g} {:.17g} {:.17g}\n", x.x(), x.y(), x.z());
  text += fmt::format("tetrahedra {}\n", mesh.tetrahedra.size());
  for (const auto& corners : mesh.tetrahedra) text += fmt::format("{}\n", fmt::join(corners, " "));
  for (const auto& [name, faces] : {std::pair{"outer", &mesh.outer}, std::pair{"bonded", &mesh.bonded}}) {
    text += fmt::format("{} {}\n", name, faces->size());
    for (const auto& corners : *faces) text += fmt::format("{}\n", fmt::join(corners, " "));
  }
  write_whole_file(file, text);
}

PeerResult run_peer(const std::filesystem::path& mesh_file, const PeerProblem& problem) {
  std::filesystem::path out = mesh_file;
  out += ".peer.json";
  std::filesystem::path log = mesh_file;
  log += ".peer.log";
  const auto number = [](double value) { return fmt::format("{:.17g}", value); };
  const int code =
      run_to_end({kPython, std::string(TOUCHSTONE_SOURCE_DIR) + "/bench/getfem_peer.py", mesh_file.string(), "--out",
                  out.string(), "--element", problem.element, "--load", problem.load, "--young",
                  number(problem.material.youngs_modulus), "--poisson", number(problem.material.poisson_ratio),
                  "--radius", number(problem.radius), "--depth", number(problem.depth)},
                 log);
  if (code != 0) fail("the peer ended with {}: {}", code, read_whole_file(log));
  const nlohmann::json record = nlohmann::json::parse(read_whole_file(out));
  const nlohmann::json& seconds = record.at("seconds");
  PeerResult result;
  result.force = record.at("force_N").get<double>();
  if (!record.at("work_Nmm").is_null()) result.work = record.at("work_Nmm").get<double>();
  result.peak_displacement = record.at("peak_displacement_mm").get<double>();
  result.unknowns = record.at("unknowns").get<int>();
  result.newton_steps = record.at("newton_steps").get<int>();
  result.converged = record.at("converged").get<bool>();
  result.mesh_seconds = seconds.at("mesh").get<double>();
  result.model_seconds = seconds.at("model").get<double>();
  result.assembly_seconds = seconds.at("assembly").get<double>();
  result.newton_seconds = seconds.at("newton").get<double>();
  result.total_seconds = seconds.at("total").get<double>();
  result.factorise_seconds = seconds.at("factorise_once").get<double>();
  return result;
}

}  // namespace touchstone::bench
