#include "pipeline/calibration/solve/normal_matrix.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

TEST(NormalMatrix, ReportsACombinationThatNothingMeasures) {
  Eigen::Matrix3d sum;
  sum << 1e6, -2e3, 0.0, -2e3, 4.0, 0.0, 0.0, 0.0, 1e-3;  // the first two only as 1000 a - 2 b
  const auto made = NormalMatrix::factorise(Eigen::MatrixXd(sum));
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::degenerate);
  EXPECT_NE(made.error().message.find("singular"), std::string::npos);
}

TEST(NormalMatrix, GivesTheCovarianceOfUnknownsOfAllSizes) {
  Eigen::Matrix2d sum;
  sum << 4e12, 1e3, 1e3, 1e-6;
  const auto made = NormalMatrix::factorise(Eigen::MatrixXd(sum));
  ASSERT_TRUE(made);
  const double determinant = 4e12 * 1e-6 - 1e6;
  EXPECT_NEAR(made->solve(Eigen::MatrixXd::Identity(2, 2))(1, 1) * determinant / 4e12, 1.0, 1e-9);
  EXPECT_NEAR(made->half_solve(Eigen::MatrixXd::Identity(2, 2)).col(0).squaredNorm() * determinant / 1e-6, 1.0, 1e-9);
}

}  // namespace
}  // namespace scanrig
