//! The pictures of a sequence, one after another: the camera of each, or the frame.

use std::path::PathBuf;

use super::{
    super::{
        Failure,
        args::RenderRequest,
        progress::Progress,
        render::{Input, say_read},
        say,
    },
    Axis, Sequence, What,
};
use planisphere_io::{
    load::{self, Control, Loaded, Opened, Watch},
    particles::{File, Frame, Options},
};
use planisphere_renderer::{Camera, Error, Request};

/// Where the pictures of a sequence come from.
pub(super) struct Pictures<'a> {
    /// The numbers of all of them; one at least.
    pub numbers: Vec<usize>,
    /// What the first is drawn of.
    pub first: Request,
    /// Whether pixels may be clear.
    pub transparent: bool,
    /// The files that were read beside the one that is drawn.
    pub files: Vec<PathBuf>,
    watch: Watch,
    way: Way<'a>,
}

/// What differs from picture to picture.
enum Way<'a> {
    /// The camera turns about a line.
    Turn { camera: Camera, about: [f64; 3], axis: [f64; 3], of: u32 },
    /// Each is of another frame.
    Frames { file: Box<File>, options: Options, input: Input<'a>, camera: Camera },
}

impl<'a> Pictures<'a> {
    /// Reads the first of them, and says what was understood.
    pub fn open(asked: &'a RenderRequest, sequence: &Sequence) -> Result<Self, Failure> {
        let RenderRequest { scene, picture, reading, camera, .. } = asked;
        let input = Input { scene, picture, reading, camera };
        match sequence.what {
            What::Turn(of, axis) => {
                let (loaded, first) = input.load()?;
                let numbers = (0..of as usize).collect();
                Self::turning(numbers, first, loaded, axis)
            }
            What::Frames(frames) => {
                let (control, mut options) = (Control::new(), reading.options());
                options.outline_by = picture.look.outline_by().map(Into::into);
                let progress = Progress::of("loading", &control);
                let Opened::Particles(file) = load::open(scene, &options, &control)? else {
                    return Err(Failure::Usage(
                        "--frames is for files of particles, and this is a scene file; leave it \
                         out, or turn the camera: --turntable 120"
                            .into(),
                    ));
                };
                let numbers = frames.numbers(&file, &control)?;
                options.frame = Frame::FromFirst(numbers[0]);
                let loaded = load::of_frame(&file, &options, &control)?;
                let (loaded, first) = input.request(loaded, None)?;
                drop(progress);
                say_read(&loaded);
                let camera = Camera::try_from(loaded.camera(loaded.image)).map_err(Error::from)?;
                if loaded.fixed_camera.is_none() {
                    let number = numbers[0];
                    say(&format!("note: the camera is chosen once, to suit frame {number}"));
                }
                if reading.color_by.is_some() && reading.range.is_none() {
                    say("note: where values are numbers, the ends of the colour map are those of \
                         each frame; --range LO,HI gives all the same");
                }
                let way = Way::Frames { file, options, input, camera };
                Ok(Self::of(numbers, first, loaded, way))
            }
        }
    }

    /// A camera that turns.
    fn turning(
        numbers: Vec<usize>,
        first: Request,
        loaded: Loaded,
        axis: Axis,
    ) -> Result<Self, Failure> {
        say_read(&loaded);
        let (bounds, core) = (loaded.scene.bounds(), loaded.camera(loaded.image));
        // Where a camera is chosen it looks at this point from so far that it sees a ball around
        // all spheres: from all sides.
        let about = (0.5 * bounds.min_center + 0.5 * bounds.max_center).to_array();
        let axis = match axis {
            Axis::Up => core.up.to_array(),
            Axis::X => [1.0, 0.0, 0.0],
            Axis::Y => [0.0, 1.0, 0.0],
            Axis::Z => [0.0, 0.0, 1.0],
        };
        let camera = Camera::try_from(core).map_err(Error::from)?;
        let of = numbers.len() as u32;
        Ok(Self::of(numbers, first, loaded, Way::Turn { camera, about, axis, of }))
    }

    fn of(numbers: Vec<usize>, first: Request, loaded: Loaded, way: Way<'a>) -> Self {
        let transparent = loaded.look.is_transparent();
        let Loaded { files, watch, .. } = loaded;
        Self { numbers, first, transparent, files, watch, way }
    }

    /// What a picture is drawn of, by its place, and the files that its numbers lie in.
    pub fn picture(&self, place: usize) -> Result<(Request, Watch), Failure> {
        if place == 0 {
            return Ok((self.first.clone(), self.watch.clone()));
        }
        match &self.way {
            Way::Turn { camera, about, axis, of } => {
                let camera = camera.turned(*about, *axis, place as u32, *of)?;
                Ok((self.first.clone().camera(camera), self.watch.clone()))
            }
            Way::Frames { file, options, input, camera } => {
                let frame = Frame::FromFirst(self.numbers[place]);
                let options = Options { frame, ..options.clone() };
                let loaded = load::of_frame(file, &options, &Control::new())?;
                let (loaded, request) = input.request(loaded, Some(*camera))?;
                Ok((request, loaded.watch))
            }
        }
    }
}
