#pragma once
#include <string>

/// Presses the object of a file on the device of another with a force, and keeps the picture as PNG.
/// @return the force on the object along z that the gel gives back, N
double grip(const std::string& device_file, const std::string& object_file, double force_N, const std::string& picture);
