// Eigen's loops of dense products, for matrices and vectors of doubles of any size. Each source that includes this
// header calls them; eigen_kernels.cpp compiles them, which takes two seconds.
#pragma once

#include <Eigen/Core>

namespace Eigen::internal {

// C += alpha A B of packed panels
extern template struct gebp_kernel<double, double, Index, blas_data_mapper<double, Index, ColMajor>,
                                   gebp_traits<double, double>::mr, gebp_traits<double, double>::nr, false, false>;
// y += alpha A x of A by columns, and by rows
extern template struct general_matrix_vector_product<Index, double, const_blas_data_mapper<double, Index, ColMajor>,
                                                     ColMajor, false, double,
                                                     const_blas_data_mapper<double, Index, RowMajor>, false>;
extern template struct general_matrix_vector_product<Index, double, const_blas_data_mapper<double, Index, RowMajor>,
                                                     RowMajor, false, double,
                                                     const_blas_data_mapper<double, Index, ColMajor>, false>;

}  // namespace Eigen::internal
