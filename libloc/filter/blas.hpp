// The few BLAS and LAPACK routines that a large covariance is made of, by overloads for double and float. Matrices are
// column-major with a leading dimension, as there. The routines pick their kernel by the processor at run time, so that
// a portable build of ours is as fast as they are.
#pragma once

#include <string>

namespace loc::blas {

enum class Transpose : char { kNo = 'N', kYes = 'T' };

/// C = alpha op(A) op(B) + beta C; C is m x n, the inner size is k.
void gemm(Transpose a_op, Transpose b_op, int m, int n, int k, double alpha, const double* a, int lda, const double* b,
          int ldb, double beta, double* c, int ldc);
void gemm(Transpose a_op, Transpose b_op, int m, int n, int k, float alpha, const float* a, int lda, const float* b,
          int ldb, float beta, float* c, int ldc);

/// Lower triangle of C += alpha A A^T; C is n x n, A is n x k.
void syrk_lower(int n, int k, double alpha, const double* a, int lda, double* c, int ldc);
void syrk_lower(int n, int k, float alpha, const float* a, int lda, float* c, int ldc);

/// Lower triangle of C += alpha (A B^T + B A^T); C is n x n, A and B are n x k.
void syr2k_lower(int n, int k, double alpha, const double* a, int lda, const double* b, int ldb, double* c, int ldc);
void syr2k_lower(int n, int k, float alpha, const float* a, int lda, const float* b, int ldb, float* c, int ldc);

/// B = B L^-T; B is m x n, L lower triangular.
void solve_right_lower_transposed(int m, int n, const double* l, int ldl, double* b, int ldb);
void solve_right_lower_transposed(int m, int n, const float* l, int ldl, float* b, int ldb);

/// Cholesky factor of the lower triangle in place, A = L L^T. @returns false when A is not positive definite.
bool cholesky_lower(int n, double* a, int lda);
bool cholesky_lower(int n, float* a, int lda);

/// Which kernels run: the name that OpenBLAS gives the processor, or "unknown" for another BLAS.
std::string kernel_name();

}  // namespace loc::blas
