// A URDF as an object of three.js: urdf-loader reads it, and links without a
// <visual> become rods from joint to joint.
import {
  BackSide, Color, CylinderGeometry, Group, Mesh, MeshLambertMaterial, Object3D,
  Quaternion, SphereGeometry,
  FrontSide, Vector3,
} from 'three';
import URDFLoader from 'urdf-loader';
import type {URDFJoint, URDFLink, URDFRobot} from 'urdf-loader';
import type {JointData, MechanismData} from '../page_data';

export interface Robot {
  root: Object3D;
  size: number; // m
  heights: [number, number]; // m, lowest and highest point at rest
  meshes: string[]; // that could not be loaded
  set(joint: number, q: ArrayLike<number>): void;
  paint(joint: number, color: [number, number, number]): void;
  dispose(): void;
}

export function loadRobot(mechanism: MechanismData, ghost: boolean): Robot {
  const meshes: string[] = [];
  const loader = new URDFLoader();
  loader.loadMeshCb = (path, _manager, _material, done) => {
    meshes.push(path.split('/').pop() ?? path);
    done(new Group());
  };
  const robot = loader.parse(mechanism.urdf);
  // Of those that follow others (<mimic>) too, which the loader moves along.
  for (const j of Object.values(robot.joints)) j.ignoreLimits = true;
  robot.updateMatrixWorld(true);
  const {size, heights} = extent(robot);
  const joints = mechanism.joints.map(j => find(robot, j));
  const materials = dress(robot, joints, ghost, size);
  const turn = new Quaternion();
  return {
    root: robot, size, heights, meshes,
    set(i, q) {
      const {joint, rest} = joints[i];
      if (mechanism.joints[i].type === 'spherical') {
        // urdf-loader does not know the type: q turns the child in the joint's
        // frame.
        turn.set(q[0], q[1], q[2], q[3]).normalize();
        joint.quaternion.copy(rest).multiply(turn);
      } else {
        joint.setJointValue(q[0]);
      }
    },
    paint(i, color) {
      for (const m of materials[i]) m.color = new Color().setRGB(
          color[0] / 255, color[1] / 255, color[2] / 255, 'srgb');
    },
    dispose() {
      robot.traverse(o => {
        if (o instanceof Mesh) {
          o.geometry.dispose();
          for (const m of [o.material].flat()) m.dispose();
        }
      });
    },
  };
}

interface Placed {
  joint: URDFJoint;
  rest: Quaternion;
}

function find(robot: URDFRobot, data: JointData): Placed {
  const joint = robot.joints[data.name];
  if (!joint) throw new Error(`the URDF has no joint ${data.name}`);
  return {joint, rest: joint.quaternion.clone()};
}

const isLink = (o: Object3D): o is URDFLink => (o as URDFLink).isURDFLink === true;
const isJoint = (o: Object3D): o is URDFJoint => (o as URDFJoint).isURDFJoint === true;

// The farthest that any joint, frame or centre of mass is from the base, and
// how low and high they are.
function extent(robot: URDFRobot): {size: number; heights: [number, number]} {
  const base = robot.getWorldPosition(new Vector3());
  let reach = 0, low = base.z, high = base.z;
  const take = (p: Vector3) => {
    reach = Math.max(reach, p.distanceTo(base));
    low = Math.min(low, p.z);
    high = Math.max(high, p.z);
  };
  robot.traverse(o => {
    if (!isLink(o) && !isJoint(o)) return;
    take(o.getWorldPosition(new Vector3()));
    const com = isLink(o) ? centreOfMass(o) : null;
    if (com) take(o.localToWorld(com));
  });
  return {size: reach || 1, heights: [low, high]};
}

function centreOfMass(link: URDFLink): Vector3 | null {
  const origin = link.urdfNode?.querySelector('inertial > origin');
  const xyz = origin?.getAttribute('xyz')?.trim().split(/\s+/).map(Number);
  return xyz?.length === 3 && xyz.every(Number.isFinite) ? new Vector3(...xyz) : null;
}

// Materials by moving joint: of the links that hang on it, down to the next.
function dress(robot: URDFRobot, joints: Placed[], ghost: boolean, size: number) {
  const materials: MeshLambertMaterial[][] = joints.map(() => []);
  const still = material(ghost, [140, 140, 140]);
  const visit = (o: Object3D, moving: number) => {
    const i = joints.findIndex(p => p.joint === o);
    const of = i >= 0 ? i : moving;
    for (const child of [...o.children]) visit(child, of);
    if (!isLink(o)) return;
    const own = of < 0 ? still : material(ghost, [90, 140, 190]);
    if (of >= 0) materials[of].push(own);
    dressLink(o, own, size);
  };
  visit(robot, -1);
  return materials;
}

function material(ghost: boolean, rgb: [number, number, number]) {
  return new MeshLambertMaterial({
    color: new Color().setRGB(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255, 'srgb'),
    transparent: ghost,
    opacity: ghost ? 0.6 : 1,
    depthWrite: !ghost,
    // The far side only, so that the ghost does not cover the solid one.
    side: ghost ? BackSide : FrontSide,
  });
}

function dressLink(link: URDFLink, own: MeshLambertMaterial, size: number) {
  let drawn = false;
  for (const child of link.children) {
    if (isJoint(child)) continue;
    child.traverse(o => {
      if (!(o instanceof Mesh)) return;
      o.material = own;
      drawn = true;
    });
  }
  if (drawn) return;
  const ends = link.children.filter(isJoint).map(j => j.position.clone());
  const com = centreOfMass(link);
  if (!ends.some(e => e.length() > 1e-9) && com) ends.push(com);
  // The ghost is a halo around the solid one where both agree.
  const radius = size * (own.transparent ? 0.022 : 0.014);
  const rods = ends.filter(e => e.length() > 1e-9);
  if (rods.length) link.add(new Mesh(new SphereGeometry(radius * 1.7, 20, 14), own));
  for (const end of rods) link.add(rod(end, radius, own));
  if ((link as Object3D as URDFRobot).isURDFRobot && !own.transparent) link.add(plate(radius, own));
  // A bob where a rod ends in the centre of mass; elsewhere it would clutter.
  if (com && rods.some(e => e.distanceTo(com) < 1e-6)) {
    const bob = new Mesh(new SphereGeometry(radius * 2.4, 24, 16), own);
    bob.position.copy(com);
    link.add(bob);
  }
}

// The fixed base: a plate under its first joint.
function plate(radius: number, own: MeshLambertMaterial): Mesh {
  const mesh = new Mesh(new CylinderGeometry(radius * 5, radius * 5, radius * 0.8, 32), own);
  mesh.rotation.x = Math.PI / 2;
  return mesh;
}

// From the origin to `end`.
function rod(end: Vector3, radius: number, own: MeshLambertMaterial): Mesh {
  const mesh = new Mesh(new CylinderGeometry(radius, radius, end.length(), 16), own);
  mesh.position.copy(end).multiplyScalar(0.5);
  mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), end.clone().normalize());
  return mesh;
}
