#pragma once
// How well a least-squares fit knows its variables, and which combinations of them it doesn't know at all.

#include <Eigen/Core>
#include <vector>

namespace touchstone::lab {

/// A finished fit, linearised. Residuals are divided by their standard deviations as they were thought to be; variables
/// are in units of half of their allowed range.
struct LinearisedFit {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residuals;
  /// Rows that belong to one place of the picture, in all pictures and colours: model errors are alike there. -1: a
  /// number with an error of its own (a force, a label).
  std::vector<int> tile;
  int tiles = 0;
  std::vector<int> patch;  ///< by row: one tile in one picture and colour; empty: errors are alike nowhere
  int shared =
      0;  ///< so many variables, the first ones, act in all pictures; each other one belongs to a single picture
  /// By row: what one standard error of something that is wrong in all rows alike changes: the mesh in forces, and the
  /// simulated light's own noise in pictures. Either may be empty.
  Eigen::VectorXd mesh_error, light_error;
};

/// Standard errors, where they come from, and what can't be identified.
struct FitCertainty {
  Eigen::VectorXd deviation;     ///< standard error of each variable, all in all; infinite where nothing holds it
  Eigen::VectorXd by_noise;      ///< of it: as J^T J has it, with the residuals' own variance
  Eigen::VectorXd by_model;      ///< as leaving out tiles has it; 0 of what isn't shared
  Eigen::VectorXd by_light;      ///< of light_error
  Eigen::VectorXd by_mesh;       ///< of mesh_error
  std::vector<char> identified;  ///< 0: its 95 % interval is as wide as its range, or wider
  Eigen::MatrixXd unidentified;  ///< orthonormal columns: combinations that the data can't identify
  double alike = 1.0;            ///< how much more sums over patches scatter than those of independent residuals
  double picture_misfit = 0.0;   ///< root mean square of the tiles' residuals
  double number_misfit = 0.0;    ///< of the others'; 0 without any
};

/// With J^T J = V S^2 V^T a combination v_k has the standard error s / S_k, where s is the root mean square misfit
/// (at least 1; pictures' and numbers' apart): what is wrong with the model widens all intervals. Errors of a model are
/// alike over some distance in the picture, and in all pictures, so that pixels count for less than they are: a shared
/// variable's standard error is at least the delete-a-group jackknife's, whose groups are tiles ([Efron1993, sec.
/// 11.5]; one Gauss-Newton step for each tile left out, the other variables held). What pictures leave open of a
/// variable that isn't shared, and that a single tile may identify, is widened by `alike`, by which sums of residuals
/// over patches scatter more than those of independent ones (the blocking of [Flyvbjerg1989]). A combination is
/// unidentified if 1.96 of its standard errors reach over half of its range in units of the variables, which is 1.
/// @pre at least one row and one column, sizes fit
FitCertainty certainty_of(const LinearisedFit& fit);

}  // namespace touchstone::lab
