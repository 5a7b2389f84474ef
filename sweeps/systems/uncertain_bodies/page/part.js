// The part of bodies that are not known exactly: their table, coloured by the outlook.

const part = {
  buildTable: () => buildBodies(),
};
