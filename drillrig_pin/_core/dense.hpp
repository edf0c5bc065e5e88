// Small dense solves on memory given by the caller: at six unknowns a general library spends more time on bookkeeping.
#pragma once

#include <cmath>

namespace drillrig::dense {

// Cholesky factor L (lower, row-major, n x n) of a symmetric matrix given by columns, upper triangle. False: not positive.
inline bool factor(const double* M, int n, double* L) {
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = M[i * n + j];  // column i, row j <= i: the upper triangle
      for (int k = 0; k < j; ++k) sum -= L[i * n + k] * L[j * n + k];
      if (i != j) {
        L[i * n + j] = sum * L[j * n + j];
      } else {
        if (!(sum > 0.0)) return false;
        L[i * n + i] = 1.0 / std::sqrt(sum);  // the inverse of the diagonal is what every use needs
      }
    }
  }
  return true;
}

// x <- L^-1 x
inline void forward(const double* L, int n, double* x) {
  for (int i = 0; i < n; ++i) {
    double sum = x[i];
    for (int k = 0; k < i; ++k) sum -= L[i * n + k] * x[k];
    x[i] = sum * L[i * n + i];
  }
}

// x <- L^-T x
inline void backward(const double* L, int n, double* x) {
  for (int i = n - 1; i >= 0; --i) {
    const double value = x[i] *= L[i * n + i];
    for (int k = 0; k < i; ++k) x[k] -= L[i * n + k] * value;
  }
}

inline double dot(const double* a, const double* b, int n) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

// Eigenvalues (left on the diagonal of S) and vectors (rows of V) of a symmetric n x n matrix by Jacobi's rotations.
inline void eigen(double* S, int n, double* V) {
  constexpr int kSweeps = 30;
  for (int i = 0; i < n * n; ++i) V[i] = i % (n + 1) == 0 ? 1.0 : 0.0;
  bool turned = true;
  for (int sweep = 0; turned && sweep < kSweeps; ++sweep) {
    turned = false;
    double largest = 0.0;
    for (int i = 0; i < n; ++i) largest = std::fmax(largest, std::abs(S[i * n + i]));
    // Below this the rotations only stir their own rounding.
    const double nothing = 1e-16 * n * largest;
    for (int p = 0; p < n; ++p) {
      for (int q = p + 1; q < n; ++q) {
        const double off = S[p * n + q];
        if (!(std::abs(off) > nothing)) continue;
        turned = true;
        const double theta = (S[q * n + q] - S[p * n + p]) / (2.0 * off);
        const double t = (theta < 0.0 ? -1.0 : 1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1.0));
        const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c;
        S[p * n + p] -= t * off;
        S[q * n + q] += t * off;
        S[p * n + q] = S[q * n + p] = 0.0;
        for (int k = 0; k < n; ++k) {
          if (k == p || k == q) continue;
          const double a = S[p * n + k], b = S[q * n + k];
          S[k * n + p] = S[p * n + k] = c * a - s * b;
          S[k * n + q] = S[q * n + k] = s * a + c * b;
        }
        for (int k = 0; k < n; ++k) {
          const double a = V[p * n + k], b = V[q * n + k];
          V[p * n + k] = c * a - s * b;
          V[q * n + k] = s * a + c * b;
        }
      }
    }
  }
}

}  // namespace drillrig::dense
