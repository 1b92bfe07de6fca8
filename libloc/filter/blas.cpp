#include "libloc/filter/blas.hpp"

#include <cstddef>

// The Fortran interface, which every BLAS has; the hidden lengths of the character arguments are those of gfortran.
// NOLINTBEGIN(readability-identifier-naming)
extern "C" {
void dgemm_(const char*, const char*, const int*, const int*, const int*, const double*, const double*, const int*,
            const double*, const int*, const double*, double*, const int*, std::size_t, std::size_t);
void sgemm_(const char*, const char*, const int*, const int*, const int*, const float*, const float*, const int*,
            const float*, const int*, const float*, float*, const int*, std::size_t, std::size_t);
void dsyrk_(const char*, const char*, const int*, const int*, const double*, const double*, const int*, const double*,
            double*, const int*, std::size_t, std::size_t);
void ssyrk_(const char*, const char*, const int*, const int*, const float*, const float*, const int*, const float*,
            float*, const int*, std::size_t, std::size_t);
void dsyr2k_(const char*, const char*, const int*, const int*, const double*, const double*, const int*, const double*,
             const int*, const double*, double*, const int*, std::size_t, std::size_t);
void ssyr2k_(const char*, const char*, const int*, const int*, const float*, const float*, const int*, const float*,
             const int*, const float*, float*, const int*, std::size_t, std::size_t);
void dtrsm_(const char*, const char*, const char*, const char*, const int*, const int*, const double*, const double*,
            const int*, double*, const int*, std::size_t, std::size_t, std::size_t, std::size_t);
void strsm_(const char*, const char*, const char*, const char*, const int*, const int*, const float*, const float*,
            const int*, float*, const int*, std::size_t, std::size_t, std::size_t, std::size_t);
void dpotrf_(const char*, const int*, double*, const int*, int*, std::size_t);
void spotrf_(const char*, const int*, float*, const int*, int*, std::size_t);
char* openblas_get_corename() __attribute__((weak));
}
// NOLINTEND(readability-identifier-naming)

namespace loc::blas {

void gemm(Transpose a_op, Transpose b_op, int m, int n, int k, double alpha, const double* a, int lda, const double* b,
          int ldb, double beta, double* c, int ldc) {
  const char ta = static_cast<char>(a_op);
  const char tb = static_cast<char>(b_op);
  dgemm_(&ta, &tb, &m, &n, &k, &alpha, a, &lda, b, &ldb, &beta, c, &ldc, 1, 1);
}
void gemm(Transpose a_op, Transpose b_op, int m, int n, int k, float alpha, const float* a, int lda, const float* b,
          int ldb, float beta, float* c, int ldc) {
  const char ta = static_cast<char>(a_op);
  const char tb = static_cast<char>(b_op);
  sgemm_(&ta, &tb, &m, &n, &k, &alpha, a, &lda, b, &ldb, &beta, c, &ldc, 1, 1);
}

void syrk_lower(int n, int k, double alpha, const double* a, int lda, double* c, int ldc) {
  const double one = 1;
  dsyrk_("L", "N", &n, &k, &alpha, a, &lda, &one, c, &ldc, 1, 1);
}
void syrk_lower(int n, int k, float alpha, const float* a, int lda, float* c, int ldc) {
  const float one = 1;
  ssyrk_("L", "N", &n, &k, &alpha, a, &lda, &one, c, &ldc, 1, 1);
}

void syr2k_lower(int n, int k, double alpha, const double* a, int lda, const double* b, int ldb, double* c, int ldc) {
  const double one = 1;
  dsyr2k_("L", "N", &n, &k, &alpha, a, &lda, b, &ldb, &one, c, &ldc, 1, 1);
}
void syr2k_lower(int n, int k, float alpha, const float* a, int lda, const float* b, int ldb, float* c, int ldc) {
  const float one = 1;
  ssyr2k_("L", "N", &n, &k, &alpha, a, &lda, b, &ldb, &one, c, &ldc, 1, 1);
}

void solve_right_lower_transposed(int m, int n, const double* l, int ldl, double* b, int ldb) {
  const double one = 1;
  dtrsm_("R", "L", "T", "N", &m, &n, &one, l, &ldl, b, &ldb, 1, 1, 1, 1);
}
void solve_right_lower_transposed(int m, int n, const float* l, int ldl, float* b, int ldb) {
  const float one = 1;
  strsm_("R", "L", "T", "N", &m, &n, &one, l, &ldl, b, &ldb, 1, 1, 1, 1);
}

bool cholesky_lower(int n, double* a, int lda) {
  int info = 0;
  dpotrf_("L", &n, a, &lda, &info, 1);
  return info == 0;
}
bool cholesky_lower(int n, float* a, int lda) {
  int info = 0;
  spotrf_("L", &n, a, &lda, &info, 1);
  return info == 0;
}

std::string kernel_name() {
  return openblas_get_corename != nullptr ? openblas_get_corename() : "unknown";
}

}  // namespace loc::blas
