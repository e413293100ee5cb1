#pragma once
// A compliance in a file that is read in place.
//
// The file, little-endian:
//   0     8 letters "TSCOMPLY"
//   8     format's number, 32 bits; then 32 bits of zero
//   16    the key, 64 hexadecimal digits
//   80    64-bit numbers: size of the file; offset and size of the body; offset, rows and columns of `surface`;
//         the same of `beads`. The two matrices begin at multiples of 4096, column after column of doubles
//         (a `surface` of one column is the numbers of a compliance with compressed far parts)
//   152   XXH3, 128 bits, canonical (big-endian): of all before it and of all after it
// The body holds what is small: geometry, mass matrix, report, the layout of compressed parts. (XXH3: Y. Collet's
// xxHash 0.8; it isn't cryptographic and needn't be: it guards against faults, and 42 MB take 4 ms where SHA-256
// took 96.)

#include <filesystem>
#include <string>

#include "fem/elements/compliance.h"

namespace touchstone::fem {

/// Raised with each change of the file's layout, or of how a compliance is computed.
inline constexpr int kComplianceFormat = 6;

/// Writes the file whole or not at all (see write_whole_file). `key` has 64 characters. @throws Error if it can't
void write_compliance(const std::filesystem::path& path, const std::string& key, const Compliance& gel);

/// Reads it back bit for bit; its two matrices stay in the mapped file. Each byte is checked before any is believed.
/// @throws Error that says, as the second half of a sentence about the file, why it can't be used
Compliance read_compliance(const std::filesystem::path& path, const std::string& key);

/// Bytes that the file of a gel of `surface_vertices` and `beads` takes, within 1 % from some hundred vertices on.
double compliance_file_bytes(int surface_vertices, int beads);

}  // namespace touchstone::fem
