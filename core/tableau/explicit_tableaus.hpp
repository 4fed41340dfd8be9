// The explicit methods with few stages, each with dense output of order p - 1 at least.
//   Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I" (1993): [HNW].
#pragma once

#include "core/tableau/method.hpp"

namespace mbsopt {

// Euler's method has no estimate, so it takes fixed steps only.
inline constexpr Tableau<1> kEuler{.name = "euler", .order = 1, .dense_order = 1, .b = {1}, .dense = {{{1}}}};

// Ralston, "Runge-Kutta methods with minimum error bounds", Math. Comp. 16 (1962): the two-stage method of order 2 with
// the least bound of its local error. The estimate is the difference from Euler's method, which it contains.
inline constexpr Tableau<2> kRk2{.name = "rk2",
                                 .order = 2,
                                 .dense_order = 2,
                                 .error_order = 2,
                                 .c = {0, 2. / 3},
                                 .A = {{{0}, {2. / 3}}},
                                 .b = {1. / 4, 3. / 4},
                                 .error = {-3. / 4, 3. / 4},
                                 .dense = {{{1, -3. / 4}, {0, 3. / 4}}}};

// Bogacki and Shampine, "A 3(2) pair of Runge-Kutta formulas", Appl. Math. Lett. 2 (1989). The last stage is f(y1),
// which the estimate needs. Dense output is the cubic through y0, y1 and their derivatives.
inline constexpr Tableau<4> kBs3{.name = "bs3",
                                 .order = 3,
                                 .dense_order = 3,
                                 .error_order = 3,
                                 .c = {0, 1. / 2, 3. / 4, 1},
                                 .A = {{{0}, {1. / 2}, {0, 3. / 4}, {2. / 9, 1. / 3, 4. / 9}}},
                                 .b = {2. / 9, 1. / 3, 4. / 9, 0},
                                 .error = {-5. / 72, 1. / 12, 1. / 9, -1. / 8},
                                 .dense = {{{1, -4. / 3, 5. / 9}, {0, 1, -2. / 3}, {0, 4. / 3, -8. / 9}, {0, -1, 1}}}};

// Kutta's classical method: [HNW], section II.1. Its continuous extension of order 3: section II.6, exercise 1. It has
// no estimate, so it takes fixed steps only.
inline constexpr Tableau<4> kRk4{.name = "rk4",
                                 .order = 4,
                                 .dense_order = 3,
                                 .c = {0, 0.5, 0.5, 1},
                                 .A = {{{0}, {0.5}, {0, 0.5}, {0, 0, 1}}},
                                 .b = {1. / 6, 1. / 3, 1. / 3, 1. / 6},
                                 .dense = {{{1, -1.5, 2. / 3}, {0, 1, -2. / 3}, {0, 1, -2. / 3}, {0, -0.5, 2. / 3}}}};

// Dormand and Prince, "A family of embedded Runge-Kutta formulae", J. Comp. Appl. Math. 6 (1980); dense output of order
// 4 by Shampine, "Some practical Runge-Kutta formulas", Math. Comp. 46 (1986), as in Hairer, Norsett, Wanner, section
// II.6.
inline constexpr Tableau<7> kDopri5{
    .name = "dopri5",
    .order = 5,
    .dense_order = 4,
    .error_order = 5,
    .c = {0, 1. / 5, 3. / 10, 4. / 5, 8. / 9, 1, 1},
    .A = {{{0},
           {1. / 5},
           {3. / 40, 9. / 40},
           {44. / 45, -56. / 15, 32. / 9},
           {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
           {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
           {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84}}},
    .b = {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84, 0},
    .error = {71. / 57600, 0, -71. / 16695, 71. / 1920, -17253. / 339200, 22. / 525, -1. / 40},
    .dense = {{{1, -8048581381. / 2820520608, 8663915743. / 2820520608, -12715105075. / 11282082432},
               {0, 0, 0, 0},
               {0, 131558114200. / 32700410799, -68118460800. / 10900136933, 87487479700. / 32700410799},
               {0, -1754552775. / 470086768, 14199869525. / 1410260304, -10690763975. / 1880347072},
               {0, 127303824393. / 49829197408, -318862633887. / 49829197408, 701980252875. / 199316789632},
               {0, -282668133. / 205662961, 2019193451. / 616988883, -1453857185. / 822651844},
               {0, 40617522. / 29380423, -110615467. / 29380423, 69997945. / 29380423}}}};

// Tsitouras, "Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying assumption", Comput. Math.
// Appl. 62 (2011), with its interpolant of order 4, which needs no further stage. The paper prints 16 digits. Nodes and
// coefficients here differ from these by at most 5e-15, weights of dense output by 5e-14. This is the method near the
// printed one that doubles represent best: no order condition of the step is off by more than 3e-16.
inline constexpr Tableau<7> kTsit5{
    .name = "tsit5",
    .order = 5,
    .dense_order = 4,
    .error_order = 5,
    .c = {0, 0.16099999999999617, 0.3269999999999957, 0.8999999999999968, 0.9800255409045089, 1, 1},
    .A = {{{0},
           {0.16099999999999617},
           {-0.00848065549236055, 0.33548065549235623},
           {2.8971530571054833, -6.359448489975011, 4.362295432869525},
           {5.325864828439254, -11.748883564062748, 7.495539342889759, -0.09249506636175674},
           {5.861455442946414, -12.920969317847014, 8.15936789857607, -0.07158497328140029, -0.02826905039406985},
           {0.09646076681806177, 0.01, 0.479889650414498, 1.3790085741037386, -3.2900695154360484, 2.32471052409975}}},
    .b = {0.09646076681806177, 0.01, 0.479889650414498, 1.3790085741037386, -3.2900695154360484, 2.32471052409975, 0},
    .error = {0.001780011052225775, 0.0008164344596567671, -0.007880878010261928, 0.1447110071732527,
              -0.5823571654525059, 0.4580821059291478, -1. / 66},
    .dense = {{{1, -2.763706197274858, 2.913255461821966, -1.0530884977290464},
               {0, 0.1317, -0.2234, 0.1017},
               {0, 3.930296236894779, -5.941033872131572, 2.4906272856512905},
               {0, -12.411077166933406, 30.338188630281778, -16.548102889244632},
               {0, 37.50931341650997, -88.17890489476413, 47.37952196281812},
               {0, -27.896526289196483, 65.09189467479196, -34.87065786149573},
               {0, 1.5, -4, 2.5}}}};

}  // namespace mbsopt
