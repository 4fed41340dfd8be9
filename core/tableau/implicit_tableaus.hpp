// Implicit methods. Stage 0 of each is the explicit one at the start of the step, f(y0): the estimate and dense output
// use it. The script tableaus.py beside this file computes the numbers and the weights of dense output.
//   Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996): [HW].
//
// error_filter is A_ii if all implicit stages share it, or else the real eigenvalue of A if there is one.
//
// Dense output of the order before last, or better, needs f(y0), and the Gauss methods also need f(y1). In a stiff
// direction with rate s it has an error of h s times the distance of y0 from the slow motion. Outputs within a fast
// transient are rough.
#pragma once

#include "core/tableau/method.hpp"

namespace mbsopt {

// sdirk2: TR-BDF2, a trapezoidal half and a BDF2 half. Bank et al., IEEE Trans. CAD 4 (1985); the estimate of order 3
// by Hosea and Shampine, "Analysis and implementation of TR-BDF2", Appl. Numer. Math. 20 (1996). L-stable, stiffly
// accurate. Alexander's two-stage method has as many implicit stages, but stage order 1 and no estimate.
inline constexpr Tableau<3> kSdirk2{.name = "sdirk2",
                                    .order = 2,
                                    .dense_order = 2,
                                    .error_order = 3,
                                    .c = {0, 0.585786437626905, 1},
                                    .A = {{{0},
                                           {0.2928932188134525, 0.2928932188134525},
                                           {0.3535533905932738, 0.3535533905932738, 0.2928932188134525}}},
                                    .b = {0.3535533905932738, 0.3535533905932738, 0.2928932188134525},
                                    .error = {0.13807118745769836, -0.3333333333333333, 0.19526214587563498},
                                    .error_filter = 0.2928932188134525,
                                    .dense = {{{0.881871005550897, -0.5283176149576233},
                                               {0.28518862050852034, 0.06836477008475339},
                                               {-0.16705962605941743, 0.4599528448728699}}}};

// sdirk3, sdirk4: the implicit halves of Kennedy and Carpenter's pairs ARK3(2)4L[2]SA and ARK4(3)6L[2]SA, "Additive
// Runge-Kutta schemes for convection-diffusion-reaction equations", Appl. Numer. Math. 44 (2003). They are L-stable and
// stiffly accurate. Their stage order is 2; the methods of Norsett and Thomsen or [HW], table IV.6.5, have 1. In stiff
// mechanisms the stage order determines the error. Both have dense output of full order without more stages.
inline constexpr Tableau<4> kSdirk3{
    .name = "sdirk3",
    .order = 3,
    .dense_order = 3,
    .error_order = 3,
    .c = {0, 0.871733043016918, 0.6, 1},
    .A = {{{0},
           {0.435866521508459, 0.435866521508459},
           {0.2576482460664272, -0.09351476757488625, 0.435866521508459},
           {0.18764102434672383, -0.595297473576955, 0.9717899277217721, 0.435866521508459}}},
    .b = {0.18764102434672383, -0.595297473576955, 0.9717899277217721, 0.435866521508459},
    .error = {-0.027099261876665316, -0.11013520969201586, 0.10306492520138458, 0.0341695463672966},
    .error_filter = 0.435866521508459,
    .dense = {{{0.9818885137740992, -1.3269677980343402, 0.5327203086069647},
               {-0.31177988778236104, 0.1095794048285534, -0.3930969906231473},
               {0.14525635920067737, 2.032280953072411, -1.2057473845513162},
               {0.18463501480758437, -0.8148925598666242, 1.066124066567499}}}};

inline constexpr Tableau<6> kSdirk4{
    .name = "sdirk4",
    .order = 4,
    .dense_order = 4,
    .error_order = 4,
    .c = {0, 0.5, 0.332, 0.62, 0.85, 1},
    .A = {{{0},
           {0.25, 0.25},
           {0.137776, -0.055776, 0.25},
           {0.14463686602698217, -0.22393190761334475, 0.4492950415863626, 0.25},
           {0.09825878328356477, -0.5915442428196704, 0.8101210538282996, 0.283164405707806, 0.25},
           {0.15791629516167136, 0, 0.18675894052400077, 0.6805652953093346, -0.27524053099500667, 0.25}}},
    .b = {0.15791629516167136, 0, 0.18675894052400077, 0.6805652953093346, -0.27524053099500667, 0.25},
    .error = {0.0032044943984591762, 0, -0.0024462511366794577, -0.02148007591958727, 0.043946868068572426,
              -0.02322503541076487},
    .error_filter = 0.25,
    .dense = {{{0.9978920955869547, -2.603403860091382, 2.8268376152468915, -1.063409555580793},
               {-0.017541029848521357, 2.513088691648902, -5.123000982336081, 2.6274533205357007},
               {0.014843495647197323, 3.2182956695956073, -5.607621923069089, 2.5612416983502846},
               {-0.0031442421424032812, -3.037812136579333, 8.780529755038309, -5.059008081007237},
               {0.014385175060609559, -0.9906225408185892, 0.959686757444956, -0.25868992268198304},
               {-0.006435494303836924, 0.9004541762447945, -1.8364312223249855, 1.1924125403840278}}}};

// gauss4, gauss6: collocation at the zeros of Legendre's polynomials: [HW], section IV.5. They are A-stable and
// symplectic, not L-stable: for long motion without fast damping. The last stage of the step is f(y1). The estimate is
// the divided difference of f over 0 and the nodes, so it compares with a formula of order 2 (3 with three nodes). It
// is scaled as that of radau5: error_filter times f(y0). A difference over 1 as well would be an order better, but
// would vanish wherever f is linear: f is a polynomial of the collocation polynomial's degree there. With two nodes A
// has no real eigenvalue, and error_filter is the modulus of its eigenvalues.
inline constexpr Tableau<4> kGauss4{
    .name = "gauss4",
    .order = 4,
    .dense_order = 3,
    .error_order = 3,
    .c = {0, 0.2113248654051871, 0.7886751345948129, 1},
    .A = {{{0}, {0, 0.25, -0.03867513459481288}, {0, 0.5386751345948129, 0.25}, {0, 0.5, 0.5}}},
    .b = {0, 0.5, 0.5},
    .error = {0.28867513459481287, -0.39433756729740643, 0.10566243270259355},
    .error_filter = 0.28867513459481287,
    .dense = {{{0.875, -1.875, 1},
               {0.21650635094610965, 1.2834936490538904, -1},
               {-0.21650635094610965, 1.7165063509461096, -1},
               {0.125, -1.125, 1}}}};

// One more stage in the middle gives dense output of order 5, at the state of the interpolant of order 4: Hairer,
// Norsett, Wanner, "Solving Ordinary Differential Equations I" (1993), section II.6.
inline constexpr Tableau<5, 6> kGauss6{
    .name = "gauss6",
    .order = 6,
    .dense_order = 5,
    .error_order = 4,
    .c = {0, 0.11270166537925831, 0.5, 0.8872983346207417, 1, 0.5},
    .A = {{{0},
           {0, 0.1388888888888889, -0.0359766675249389, 0.009789444015308325},
           {0, 0.30026319498086457, 0.2222222222222222, -0.022485417203086815},
           {0, 0.26798833376246944, 0.48042111196938336, 0.1388888888888889},
           {0, 0.2777777777777778, 0.4444444444444444, 0.2777777777777778},
           {-0.0203125, 0.32237760483719186, 0.23680555555555555, -0.08105816039274741, 0.0421875}}},
    .b = {0, 0.2777777777777778, 0.4444444444444444, 0.2777777777777778},
    .error = {0.21531442311611218, -0.3184135484179201, 0.14354294874407478, -0.04044382344226686},
    .error_filter = 0.21531442311611218,
    .dense = {{{1, -6.5, 14, -12.5, 4},
               {0, 7.39415278850618, -20.343861132567916, 19.89415278850618, -6.666666666666667},
               {0, 6.666666666666667, -22.22222222222222, 26.666666666666668, -10.666666666666666},
               {0, 0.9391805448271526, -7.433916645209861, 13.439180544827153, -6.666666666666667},
               {0, -0.5, 4, -7.5, 4},
               {0, -8, 32, -40, 16}}}};

// radau5: Radau IIA with three stages: [HW], section IV.5; the estimate of order 3, section IV.8:
// gamma_0 (h f(y0) - h p(0)), p the parabola through the stages' f. L-stable, stiffly accurate. The collocation
// polynomial has order 3; with f(y0) it is 4.
inline constexpr Tableau<4> kRadau5{
    .name = "radau5",
    .order = 5,
    .dense_order = 4,
    .error_order = 4,
    .c = {0, 0.1550510257216822, 0.6449489742783178, 1},
    .A = {{{0},
           {0, 0.1968154772236604, -0.06553542585019839, 0.02377097434822015},
           {0, 0.3944243147390873, 0.2920734116652285, -0.04154875212599793},
           {0, 0.37640306270046725, 0.5124858261884216, 0.1111111111111111}}},
    .b = {0, 0.37640306270046725, 0.5124858261884216, 0.1111111111111111},
    .error = {0.27488882959567734, -0.42829829411536813, 0.24503907438491654, -0.0916296098652258},
    .error_filter = 0.27488882959567734,
    .dense = {{{1, -4.5, 6, -2.5},
               {0, 5.024404699913708, -8.543197149025547, 3.895195511812306},
               {0, -0.6910713665803745, 3.4320860379144356, -2.228528845145639},
               {0, 0.16666666666666666, -0.8888888888888888, 0.8333333333333334}}}};

// lobatto3c: Lobatto IIIC with three stages: [HW], table IV.5.7. L-stable, stiffly accurate, of stage order 2. Its
// first stage is at the start of the step but is not f(y0), so f adds no fourth node. The estimate is gamma_0 times the
// second difference of f over f(y0) and the other two stages.
inline constexpr Tableau<4> kLobatto3c{.name = "lobatto3c",
                                       .order = 4,
                                       .dense_order = 3,
                                       .error_order = 3,
                                       .c = {0, 0, 0.5, 1},
                                       .A = {{{0},
                                              {0, 0.16666666666666666, -0.3333333333333333, 0.16666666666666666},
                                              {0, 0.16666666666666666, 0.4166666666666667, -0.08333333333333333},
                                              {0, 0.16666666666666666, 0.6666666666666666, 0.16666666666666666}}},
                                       .b = {0, 0.16666666666666666, 0.6666666666666666, 0.16666666666666666},
                                       .error = {0.380833877207265, 0, -0.76166775441453, 0.380833877207265},
                                       .error_filter = 0.380833877207265,
                                       .dense = {{{0.4722222222222222, -0.7777777777777778, 0.3055555555555556},
                                                  {0.5277777777777778, -0.7222222222222222, 0.3611111111111111},
                                                  {0, 2, -1.3333333333333333},
                                                  {0, -0.5, 0.6666666666666666}}}};

// radau1a: Radau IA with three stages: [HW], section IV.5. L-stable, of stage order 2, not stiffly accurate. The last
// stage of the step is f(y1). The estimate is gamma_0 times the divided difference of f over 0, the inner nodes and 1.
inline constexpr Tableau<5> kRadau1a{
    .name = "radau1a",
    .order = 5,
    .dense_order = 4,
    .error_order = 4,
    .c = {0, 0, 0.3550510257216822, 0.8449489742783178, 1},
    .A = {{{0},
           {0, 0.1111111111111111, -0.1916383190435099, 0.08052720793239879},
           {0, 0.1111111111111111, 0.2920734116652285, -0.04813349705465739},
           {0, 0.1111111111111111, 0.5370223859435462, 0.1968154772236604},
           {0, 0.1111111111111111, 0.5124858261884216, 0.37640306270046725}}},
    .b = {0, 0.1111111111111111, 0.5124858261884216, 0.37640306270046725},
    .error = {0.27488882959567734, 0, -0.7351172231547496, 1.2848948823461044, -0.8246664887870321},
    .error_filter = 0.27488882959567734,
    .dense = {{{1, -4.5, 6, -2.5},
               {0, 2, -3.5555555555555554, 1.6666666666666667},
               {0, 3.765986323710904, -5.482029342668122, 2.228528845145639},
               {0, -2.765986323710904, 7.0375848982236775, -3.895195511812306},
               {0, 1.5, -4, 2.5}}}};

}  // namespace mbsopt
