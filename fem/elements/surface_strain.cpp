#include "fem/elements/surface_strain.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace touchstone::fem {

double largest_surface_gradient(std::span<const Eigen::Vector3d> vertices,
                                std::span<const std::array<int, 3>> triangles, const Eigen::MatrixX3d& displacement) {
  double largest = 0.0;
  for (const auto& t : triangles) {
    const Eigen::Vector3d e1 = vertices[t[1]] - vertices[t[0]];
    const Eigen::Vector3d e2 = vertices[t[2]] - vertices[t[0]];
    const Eigen::Vector3d x = e1.normalized();
    const Eigen::Vector3d y = e1.cross(e2).cross(e1).normalized();
    Eigen::Matrix2d edges;
    edges << e1.dot(x), e2.dot(x), e1.dot(y), e2.dot(y);
    Eigen::Matrix<double, 3, 2> difference;
    difference.col(0) = displacement.row(t[1]) - displacement.row(t[0]);
    difference.col(1) = displacement.row(t[2]) - displacement.row(t[0]);
    const Eigen::Matrix<double, 3, 2> gradient = difference * edges.inverse();
    const Eigen::Matrix2d square = gradient.transpose() * gradient;
    const double half_trace = 0.5 * square.trace();
    const double root = std::sqrt(std::max(0.0, half_trace * half_trace - square.determinant()));
    largest = std::max(largest, std::sqrt(half_trace + root));
  }
  return largest;
}

}  // namespace touchstone::fem
