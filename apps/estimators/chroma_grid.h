#pragma once

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <string>

namespace touchstone::apps {

/// Adds --grid, COLUMNSxROWS, to a command on a chroma sensor's pictures; `text` has the default.
void add_grid_option(CLI::App& command, std::string& text);

/// "10x10" as columns and rows. @throws Error unless both are from 2 to 64
Eigen::Vector2i grid_of(const std::string& text);

}  // namespace touchstone::apps
