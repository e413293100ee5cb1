#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace touchstone {

/// Bytes of the mark by which spreadsheets and editors of Windows begin a text in UTF-8; 0 if it doesn't.
std::size_t byte_order_mark(std::string_view text);

/// Are the bytes UTF-8, without halves of letters and codes that aren't letters'?
bool is_utf8(std::string_view text);

/// Reads a whole file of text, without such a mark.
/// @throws Error as read_whole_file, and for UTF-16 and UTF-32, known by their marks
std::string read_text_file(const std::filesystem::path& path);

}  // namespace touchstone
