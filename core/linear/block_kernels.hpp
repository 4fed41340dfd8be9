// The kernels of kernel_table.hpp for this machine's processor.
#pragma once

#include "core/linear/kernel_table.hpp"

namespace mbsopt {

const BlockKernels& block_kernels();  // for this processor

// Each by itself, for tests. AVX2: null where the program or the processor lacks it.
const BlockKernels& portable_block_kernels();
const BlockKernels* avx2_block_kernels();

}  // namespace mbsopt
