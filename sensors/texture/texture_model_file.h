#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "sensors/texture/texture_model.h"

namespace touchstone::sensors {

/// The model as bytes: a line "touchstone.texture_model 1", a line of JSON (operator, pitches, classes, number of
/// samples and the SHA-256 of what follows), then for each sample its class (16 bit) and its feature (32 bit floats),
/// all little endian. 960 samples of (16, 2) on 4 levels take 278 kB, and are read back bit for bit.
/// @throws Error if the model is faulty (fault_of)
std::string to_bytes(const TextureModel& model);

/// Reads what to_bytes wrote; `name` stands for the file in messages.
/// @throws Error naming the file: another format or version, a field missing, unknown or out of range, another length
///   than the header says, a checksum that doesn't fit, or a faulty model
TextureModel texture_model_from_bytes(std::string_view bytes, const std::string& name);

/// Writes the file whole or not at all.
void save(const TextureModel& model, const std::filesystem::path& path);
/// @throws Error as texture_model_from_bytes, or if the file can't be read
TextureModel load_texture_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
