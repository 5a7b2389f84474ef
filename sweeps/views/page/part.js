// The part of a system that has none of its own. A system's part defines the same name, with any of these members:
//   choices()                    columns to colour by, before the map's own
//   color                        name of the column it begins with, where that is not the first to choose
//   grows(column)                whether a column's values above 0 mean growth: they are red then, else those below
//   kept                         name → function of a link's text: further states that a link contains
//   refusal(name, text)          why a link's value of a further state is refused; "" if it is not, undefined for other names
//   rates()                      eigenvalues [real, imaginary] of the modes in which a described system is shown moving
//                                (see mode.js); null where its motion is periodic
//   shown                        objects for the console and the tests
//   build()                      builds the sections below the map
//   boundaries(xEdges, yEdges)   lines on the plane, as `boundaryLine` makes them
//   possible(x, y), impossible(xEdges, yEdges)   whether a body can be at a point of the plane, and outlines of where none can
//   landmarks()                  points of the plane with names: {name, x, y}
//   shownAt(), pointName()       position of the chosen point, if it is not a cell, and its name
//   drag(x, y)                   chooses a point between the cells, to which the ring is dragged
//   adjust(changes)              completes changes of the state
//   between()                    {rows, words} in place of measured values, if the choice is between points; or null
//   aside(place)                 text that follows the place
//   hides                        names of dimensions without a control of their own
//   opening()                    makes further choices when a page opens without a link
//   lecture(), begin(), leave()  steps of the lecture (see lecture.js), the start of each, and the state after them
//   slanted()                    ordinate that is drawn in place of the plane's vertical side, if it follows from both
//                                sides (else null): {label, up(x, y), down(x, shown), clip(y)}
//   coordinates()                adds coordinates of points that are no grid to `theMap.coordinates` and `theMap.cloud`
//   say(place)                   the point in one sentence
//   guides()                     lines on the picture of such points, as Plotly's traces
//   first()                      the place at which the page begins
//   buildTable()                 builds the map if `theMap.table` states that it is a table and no plane

const part = {};
