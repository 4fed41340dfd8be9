#include "core/linear/eigen_kernels.hpp"

namespace Eigen::internal {

template struct gebp_kernel<double, double, Index, blas_data_mapper<double, Index, ColMajor>,
                            gebp_traits<double, double>::mr, gebp_traits<double, double>::nr, false, false>;
template struct general_matrix_vector_product<Index, double, const_blas_data_mapper<double, Index, ColMajor>, ColMajor,
                                              false, double, const_blas_data_mapper<double, Index, RowMajor>, false>;
template struct general_matrix_vector_product<Index, double, const_blas_data_mapper<double, Index, RowMajor>, RowMajor,
                                              false, double, const_blas_data_mapper<double, Index, ColMajor>, false>;

}  // namespace Eigen::internal
