#pragma once

#include <array>

namespace scanrig {

/// Symmetric positive definite equations of few unknowns by L D L^T: Eigen's solvers are not inlined whole, so they
/// would not be compiled for a caller's instructions.
template <int N>
class NormalSolver {
 public:
  /// Lower triangle, j <= i. After factorise(): L below the diagonal, D on it.
  [[gnu::always_inline]] double& at(int i, int j) {
    return a_[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  }
  [[gnu::always_inline]] double at(int i, int j) const {
    return a_[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  }

  /// False if the matrix is not positive definite.
  [[gnu::always_inline]] bool factorise() {
    for (int j = 0; j < N; ++j) {
      for (int k = 0; k < j; ++k) at(j, j) -= at(j, k) * at(j, k) * at(k, k);
      if (!(at(j, j) > 0.0)) return false;
      for (int i = j + 1; i < N; ++i) {
        for (int k = 0; k < j; ++k) at(i, j) -= at(i, k) * at(j, k) * at(k, k);
        at(i, j) /= at(j, j);
      }
    }
    return true;
  }

  /// Replaces the right side by the solution.
  [[gnu::always_inline]] void solve(std::array<double, N>& x) const {
    for (std::size_t i = 0; i < N; ++i) {
      for (std::size_t k = 0; k < i; ++k) x[i] -= a_[i][k] * x[k];
    }
    for (std::size_t i = 0; i < N; ++i) x[i] /= a_[i][i];
    for (std::size_t i = N; i-- > 0;) {
      for (std::size_t k = i + 1; k < N; ++k) x[i] -= a_[k][i] * x[k];
    }
  }

  /// Element (0, 0) of the inverse.
  [[gnu::always_inline]] double first_of_inverse() const {
    std::array<double, N> x{1.0};
    solve(x);
    return x[0];
  }

 private:
  double a_[N][N] = {};
};

}  // namespace scanrig
