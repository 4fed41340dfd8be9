// The kernels of kernel_table.hpp for the processor of this machine.
#pragma once

#include "core/linear/kernel_table.hpp"

namespace mbsopt {

const BlockKernels& block_kernels();  // for this processor

// Each set by itself, for tests. avx2_block_kernels() is null if the program or the processor lacks AVX2.
const BlockKernels& portable_block_kernels();
const BlockKernels* avx2_block_kernels();

}  // namespace mbsopt
