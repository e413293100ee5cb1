#pragma once
// What touches, or stands before, the outer face of a membrane: the picture of a contact that light needs.

#include <limits>
#include <opencv2/core/mat.hpp>

namespace touchstone::render {

/// A regular grid of square cells over the outer face, in the gel frame: cell (column i, row j) is
/// left + i spacing <= x < left + (i + 1) spacing, top + j spacing <= y < top + (j + 1) spacing, as the upright picture
/// shows them (y grows from row to row). Nothing touches beyond it.
struct FaceGrid {
  double left_mm = 0.0, top_mm = 0.0;
  double spacing_mm = 0.0;
  int columns = 0, rows = 0;
};

/// The state of a face on a FaceGrid: row by row, one value a cell. A matt body of one albedo touches it or stands over
/// it; what is seen between the body and the face's free parts is the room.
struct FaceState {
  cv::Mat contact;      ///< CV_32FC1, 0 to 1: the share of a cell that is wetted
  cv::Mat gap_mm;       ///< CV_32FC1: air between face and body, 0 where it touches, infinite where no body is above;
                        ///< empty: the body has no more extent than its contact
  double albedo = 0.0;  ///< of the body, 0 to 1
  double height_mm = std::numeric_limits<double>::infinity();  ///< of the body's top above the face
};

}  // namespace touchstone::render
