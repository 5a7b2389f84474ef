// The damped top: a sentence below the map.

const part = {
  build() {
    const said = document.createElement("p");
    said.id = "damped-top";
    said.textContent = `The drag is ${theMap.drag}.`;
    document.querySelector("main").append(said);
  },
};
