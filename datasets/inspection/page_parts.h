#pragma once
// What the HTML pages and sheets share.

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace touchstone::datasets {

/// Bytes as base64, as pages hold them.
std::string base64(const std::string& bytes);

/// The beginning of a page up to its heading, with its style. @param title plain text
std::string page_begin(const std::string& title);
/// The end of a page.
std::string page_end();

/// A picture, within the page, with its words below it.
std::string picture_element(const cv::Mat& picture, const std::string& caption);

/// A text as a table's cell. @param kind "td" or "th"
std::string cell(const std::string& text, const char* kind = "td");
/// A number as a table's cell, of four digits.
std::string number_cell(double value);
/// A table that is scrolled by itself where it's wider than the page. @param head of its columns @param rows as HTML
std::string table(const std::vector<std::string>& head, const std::string& rows);

/// `count` numbers spread evenly over `first` ... `first + size - 1`, both ends among them.
std::vector<std::size_t> spread_over(std::size_t first, std::size_t size, std::size_t count);

}  // namespace touchstone::datasets
