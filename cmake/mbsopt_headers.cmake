# Writes the headers of an installed mbsopt to ${INCLUDE}/mbsopt: the public ones, listed here, and below detail/ all that
# they include, which may change. Paths inside begin with mbsopt/, so that no folder of a user's own project stands for
# them.
#   cmake -DSOURCE=. -DINCLUDE=prefix/include -P cmake/mbsopt_headers.cmake
cmake_minimum_required(VERSION 3.25)
set(public
  core/scene/scene.hpp core/scene/settings.hpp core/scene/kinematic_scene.hpp core/scene/issues.hpp
  core/mechanism/mechanism.hpp core/mechanism/state_point.hpp core/force/user_force.hpp core/expression/curve.hpp
  core/run/cost.hpp core/run/simulation_result.hpp core/simulate/simulation.hpp core/simulate/simulation_warnings.hpp
  core/start/assembly.hpp core/start/linearisation.hpp core/start/state_query.hpp core/driven/kinematics.hpp
  optim/problem/problem.hpp optim/problem/csv_table.hpp optim/problem/parameter_values.hpp
  optim/objective/objective.hpp optim/objective/evaluator.hpp optim/objective/hessian.hpp
  optim/design/design.hpp optim/fit/identification.hpp optim/check/gradient_check.hpp
  optim/tradeoff/tradeoff.hpp optim/tradeoff/advice.hpp optim/tradeoff/accuracy.hpp
  optim/solver/nonlinear_program.hpp optim/solver/ipopt_solver.hpp optim/solver/nlopt_solver.hpp
  optim/solver/sqp_solver.hpp
  optim/problem/named_terms.hpp app/json/read_problem.hpp app/program.hpp)
# Public, but not in mbsopt.hpp, which would take longer to compile.
set(apart core/body/euler_parameters.hpp core/force/differentiated_force.hpp core/run/differentiated_cost.hpp
          optim/problem/plugin.hpp)

set(pattern "#include \"((core|optim|app)/[^\"]+)\"")
set(found ${public} ${apart})
set(waiting ${found})
set(umbrella "// All of mbsopt that is public.\n#pragma once\n\n")
while(waiting)
  list(POP_FRONT waiting header)
  file(READ ${SOURCE}/${header} text)
  string(REGEX MATCHALL "${pattern}" included "${text}")
  foreach(line IN LISTS included)
    string(REGEX REPLACE "${pattern}" "\\1" path "${line}")
    if(NOT path IN_LIST found)
      list(APPEND found ${path})
      list(APPEND waiting ${path})
    endif()
  endforeach()
  string(REGEX REPLACE "${pattern}" "#include \"mbsopt/detail/\\1\"" text "${text}")
  file(WRITE ${INCLUDE}/mbsopt/detail/${header} "${text}")
  if(header IN_LIST public OR header IN_LIST apart)
    cmake_path(GET header FILENAME name)
    file(WRITE ${INCLUDE}/mbsopt/${name} "#pragma once\n\n#include \"mbsopt/detail/${header}\"  // IWYU pragma: export\n")
  endif()
  if(header IN_LIST public)
    string(APPEND umbrella "#include \"mbsopt/${name}\"  // IWYU pragma: export\n")
  endif()
endwhile()
file(WRITE ${INCLUDE}/mbsopt/mbsopt.hpp "${umbrella}")
