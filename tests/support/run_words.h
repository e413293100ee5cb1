#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "core/whole_file.h"
#include "tests/support/temporary_folder.h"

extern char** environ;

namespace touchstone::test {

/// What a run of the program left.
struct ProgramRun {
  int exit_code = -1;  ///< -1 if a signal ended it
  std::string out;
  std::string err;
};

/// Runs a command line, whose first word is a program's path. After `kill_after`, if it is positive, the process gets
/// SIGKILL.
inline ProgramRun run_words(std::vector<std::string> words,
                            std::chrono::milliseconds kill_after = std::chrono::milliseconds(0)) {
  const TemporaryFolder folder;
  const std::string out = (folder.path() / "out").string();
  const std::string err = (folder.path() / "err").string();
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT, 0600);
  pid_t process = 0;
  ProgramRun run;
  const int spawned = posix_spawn(&process, words[0].c_str(), &files, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (spawned != 0) return run;
  if (kill_after.count() > 0) {
    std::this_thread::sleep_for(kill_after);
    kill(process, SIGKILL);
  }
  int status = 0;
  waitpid(process, &status, 0);
  if (WIFEXITED(status)) run.exit_code = WEXITSTATUS(status);
  run.out = read_whole_file(out);
  run.err = read_whole_file(err);
  return run;
}

}  // namespace touchstone::test
