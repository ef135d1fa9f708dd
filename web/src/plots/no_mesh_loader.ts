// Stands in for the mesh loaders that urdf-loader imports (build.mjs).
export class STLLoader {}
export class ColladaLoader {}
