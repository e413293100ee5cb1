#include "bench/getfem_peer.h"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/error.h"
#include "core/whole_file.h"

namespace touchstone::bench {
namespace {

constexpr const char* kPython = "/usr/bin/python3";  // Debian's: another one may stand before it on PATH

/// Runs a program to its end with stdout and stderr in `log`; its exit code, or -1.
int run(const std::vector<std::string>& command, const std::filesystem::path& log) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) return -1;
  if (child == 0) {
    if (std::freopen(log.c_str(), "w", stdout) == nullptr || dup2(STDOUT_FILENO, STDERR_FILENO) < 0) _exit(127);
    setenv("OPENBLAS_NUM_THREADS", "1", 1);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

}  // namespace

std::string why_no_peer() {
  const std::filesystem::path log = std::filesystem::temp_directory_path() / fmt::format("ts-peer-{}.log", getpid());
  const int code = run({kPython, "-c", "import getfem, numpy"}, log);
  std::error_code ignored;
  std::filesystem::remove(log, ignored);
  if (code == 0) return {};
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
  const int code = run({kPython, std::string(TOUCHSTONE_SOURCE_DIR) + "/bench/getfem_peer.py", mesh_file.string(),
                        "--out", out.string(), "--element", problem.element, "--load", problem.load, "--young",
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
